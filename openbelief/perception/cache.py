"""The per-frame cache of an expensive perception: a *.perception.jsonl file that grows frame by frame."""

from __future__ import annotations

import json
import os
from collections import Counter
from pathlib import Path
from typing import Any

from openbelief.lifetime import Lifetime
from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.mask_line import FORMAT, MaskLine, line_of
from openbelief.perception.ports import Perception
from openbelief.perception.recorded import RecordedPerception, RecordedPerceptionError


class PerceptionWriter:
    """Appends frames to a *.perception.jsonl file; the header is written with the first frame that has masks.

    A frame is one write, so that a process killed in between leaves at most one cut line at the end.
    """

    def __init__(
        self, path: str | os.PathLike[str], *, text_space: str | None, feature_text_aligned: bool, about: dict[str, str]
    ) -> None:
        self.path = Path(path)
        self._header: dict[str, Any] = {"text_space": text_space, "feature_text_aligned": feature_text_aligned, **about}
        self._file = self.path.open("ab", buffering=0)

    def write(self, stamp_ns: int, masks: list[Mask]) -> list[MaskLine]:
        """The frame's masks as the lines that were written."""
        lines = [line_of(stamp_ns, mask, len(masks)) for mask in masks]
        text = "".join(line.model_dump_json() + "\n" for line in lines)
        if masks and self._file.tell() == 0:
            text = self._header_line(len(masks[0].feature)) + text
        self._file.write(text.encode())
        return lines

    def close(self) -> None:
        self._file.close()

    def _header_line(self, feature_dim: int) -> str:
        header = {"format": FORMAT, "feature_dim": feature_dim, "feature_dtype": "float16", **self._header}
        return json.dumps(header) + "\n"


class CachedPerception(Lifetime):
    """Perception port that asks `inner` for a frame once, ever; what the file holds is what every run uses.

    The file is another perception's or recording's: RecordedPerceptionError. A frame without masks leaves no line
    and is asked for again.
    """

    def __init__(
        self, inner: Perception, path: str | os.PathLike[str], *, recording: str, text_space: str | None
    ) -> None:
        self.inner, self.id, self.feature_text_aligned = inner, inner.id, inner.feature_text_aligned
        about = {"perception": inner.id, "recording": recording}
        self._known = _reopen(Path(path), about)
        self._writer = PerceptionWriter(
            path, text_space=text_space, feature_text_aligned=inner.feature_text_aligned, about=about
        )

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        masks = self.known(frame)
        return self.keep(frame, self.inner.perceive(frame)) if masks is None else masks

    def known(self, frame: RgbdFrame) -> list[Mask] | None:
        """What a former run kept of the frame, None where it kept nothing."""
        return self._known.perceive(frame) if self._known and frame.stamp_ns in self._known.stamps else None

    def keep(self, frame: RgbdFrame, masks: list[Mask]) -> list[Mask]:
        """The masks as read back, in float16: an interrupted mapping and a whole one must see the same features."""
        return [line.mask(len(masks[0].feature)) for line in self._writer.write(frame.stamp_ns, masks)]

    def close(self) -> None:
        self._writer.close()


def _reopen(path: Path, about: dict[str, str]) -> RecordedPerception | None:
    """What a former run left, without the frame that it was writing when it was killed."""
    if not path.exists():
        return None
    _drop_cut_frame(path)
    if path.stat().st_size == 0:
        return None
    known = RecordedPerception(path)
    extra = known.header.model_extra or {}
    for key, value in about.items():
        if extra.get(key) != value:
            raise RecordedPerceptionError(
                f"{path} holds masks of {key} {extra.get(key)!r}, not {value!r}: delete it, or choose another -o."
            )
    return known


def _drop_cut_frame(path: Path) -> None:
    """Truncate the file after the last frame all of whose lines are there."""
    whole = end = 0
    counts: Counter[int] = Counter()
    with path.open("r+b") as file:
        for number, line in enumerate(file):
            if not line.endswith(b"\n"):
                break
            end += len(line)
            if number == 0:
                whole = end
                continue
            mask = MaskLine.model_validate_json(line)
            counts[mask.stamp_ns] += 1
            if counts[mask.stamp_ns] == mask.masks_in_frame:
                whole = end
        file.truncate(whole)
