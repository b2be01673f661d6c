"""A recorded perception taken apart, so that a proposer of today can stand before masks and features of then."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from openbelief.arrays import Array
from openbelief.observation import RgbdFrame
from openbelief.perception.ports import PerceptionFailed, SegmentedMask
from openbelief.perception.recorded import RecordedPerception
from openbelief.phrase import comparable


class RecordedSegmenter:
    """Segmenter that finds, for a phrase, the masks which were recorded under it."""

    def __init__(self, recorded: RecordedPerception) -> None:
        self._recorded = recorded

    @property
    def id(self) -> str:
        return self._recorded.id

    def segment(self, frame: RgbdFrame, phrases: Sequence[str]) -> list[SegmentedMask]:
        masks = self._recorded.perceive(frame)
        return [
            SegmentedMask(phrase, mask.confidence, mask.pixels)
            for phrase in phrases
            for mask in masks
            if comparable(mask.phrase) == comparable(phrase)
        ]


class RecordedFeatures:
    """SegmentEncoder for the segments of a RecordedSegmenter of the same file."""

    def __init__(self, recorded: RecordedPerception) -> None:
        self._recorded = recorded

    @property
    def id(self) -> str:
        return self._recorded.id

    @property
    def dim(self) -> int:
        return self._recorded.header.feature_dim

    @property
    def text_space(self) -> str | None:
        return self._recorded.text_space if self._recorded.feature_text_aligned else None

    def encode(self, frame: RgbdFrame, segments: Sequence[SegmentedMask]) -> Array:
        """Raises PerceptionFailed where a segment is none of the recorded masks."""
        known = {_key(mask.phrase, mask.pixels): mask.feature for mask in self._recorded.perceive(frame)}
        try:
            return np.array([known[_key(segment.phrase, segment.pixels)] for segment in segments], dtype=np.float32)
        except KeyError as error:
            raise PerceptionFailed(
                f"{self.id} holds no feature for a mask of stamp {frame.stamp_ns}: name the same file as segmenter."
            ) from error


def _key(phrase: str | None, pixels: Array) -> tuple[str | None, bytes]:
    return comparable(phrase), np.packbits(pixels).tobytes()
