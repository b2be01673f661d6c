"""A perception made of parts: phrases, then segments, then features (paper Sec. III-B)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.mask_nms import suppress
from openbelief.perception.ports import PerceptionFailed, PhraseProposer, SegmentedMask, SegmentEncoder, Segmenter
from openbelief.perception.stages import Stage, in_turn


class BadModelOutput(PerceptionFailed):
    """A network gave what its port does not allow; the message names the network."""


class ComposedPerception:
    """StagedPerception over a PhraseProposer, a Segmenter and a SegmentEncoder."""

    def __init__(
        self,
        proposer: PhraseProposer,
        segmenter: Segmenter,
        features: SegmentEncoder,
        *,
        proposer_workers: int = 1,
    ) -> None:
        self._proposer, self._segmenter, self._features = proposer, segmenter, features
        self.stages = (
            Stage("phrases", lambda frame, _: proposer.propose(frame), proposer_workers),
            Stage("segments", self._segment),
            Stage("features", self._masks),
        )

    @property
    def id(self) -> str:
        return f"paper[{self._proposer.id} | {self._segmenter.id} | {self._features.id}]"

    @property
    def feature_text_aligned(self) -> bool:
        return self._features.text_space is not None

    @property
    def text_space(self) -> str | None:
        """Id of the text encoder in whose space the features live."""
        return self._features.text_space

    @property
    def about(self) -> dict[str, Any]:
        """What the id stands for, in full: prompt and decoding are stored with the memory."""
        return {"phrases": getattr(self._proposer, "about", {})}

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        """All stages, one after the other. Raises FrameUnseen, or BadModelOutput naming the network."""
        return in_turn(self.stages, frame)

    def close(self) -> None:
        """Close the parts that hold something open."""
        for part in (self._proposer, self._segmenter, self._features):
            getattr(part, "close", lambda: None)()

    def _segment(self, frame: RgbdFrame, phrases: Sequence[str]) -> list[SegmentedMask]:
        if not phrases:
            return []
        found = [_checked(segment, frame, self._segmenter.id) for segment in self._segmenter.segment(frame, phrases)]
        return suppress([segment for segment in found if segment.pixels.any()])

    def _masks(self, frame: RgbdFrame, segments: list[SegmentedMask]) -> list[Mask]:
        """c_e is the mask's score."""
        if not segments:
            return []
        rows = self._features.encode(frame, segments)
        if len(rows) != len(segments) or not np.isfinite(rows).all():
            raise BadModelOutput(f"{self._features.id} gave {np.shape(rows)}, finite: one row a segment was asked for.")
        return [
            Mask(index, segment.pixels, segment.phrase, segment.score, row)
            for index, (segment, row) in enumerate(zip(segments, rows, strict=True))
        ]


def _checked(segment: SegmentedMask, frame: RgbdFrame, who: str) -> SegmentedMask:
    pixels = np.asarray(segment.pixels)
    if pixels.dtype != bool or pixels.shape != frame.depth_m.shape:
        raise BadModelOutput(f"{who}: a mask should be {frame.depth_m.shape} bool, got {pixels.shape} {pixels.dtype}.")
    if not 0.0 < segment.score <= 1.0:
        raise BadModelOutput(f"{who}: a mask's score should be in (0, 1], got {segment.score}.")
    return segment
