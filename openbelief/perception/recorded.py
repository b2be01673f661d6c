"""Perception that was recorded: a *.perception.jsonl file played back by stamp."""

from __future__ import annotations

import hashlib
import os
from collections import defaultdict
from pathlib import Path
from typing import Any

from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.mask_line import FORMAT, Header, MaskLine, one_line

MAX_LINE_BYTES = 16 << 20


class RecordedPerceptionError(ValueError):
    """The file cannot be used; the message names file, line, cause and remedy."""


class RecordedPerception:
    """Perception port over a file. Every line is checked when the file is opened; masks are made frame by frame.

    Raises RecordedPerceptionError naming the first line that is wrong.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._offsets: dict[int, list[int]] = defaultdict(list)  # stamp_ns -> byte offsets of its lines
        digest = hashlib.sha256()
        try:
            with self.path.open("rb") as file:
                self.header = self._read_header(file.readline(MAX_LINE_BYTES), digest)
                self._index(file, digest)
        except OSError as error:
            raise RecordedPerceptionError(f"{self.path} cannot be read: {error.strerror}.") from error
        self._id = f"recorded:{self.path.name}@{digest.hexdigest()[:12]}"

    @property
    def id(self) -> str:
        """The file's name and the start of its sha256."""
        return self._id

    @property
    def feature_text_aligned(self) -> bool:
        return self.header.feature_text_aligned

    @property
    def text_space(self) -> str | None:
        """Id of the text encoder in whose space the features live."""
        return self.header.text_space

    @property
    def stamps(self) -> set[int]:
        """Stamps (ns) of the frames that have masks."""
        return set(self._offsets)

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        """The masks recorded for the frame's stamp; none where there is no line for it."""
        offsets = self._offsets.get(frame.stamp_ns, [])
        if not offsets:
            return []
        with self.path.open("rb") as file:
            return [self._mask_at(file, offset) for offset in offsets]

    def _mask_at(self, file: Any, offset: int) -> Mask:
        file.seek(offset)
        try:
            return MaskLine.model_validate_json(file.readline(MAX_LINE_BYTES)).mask(self.header.feature_dim)
        except ValueError as error:
            raise RecordedPerceptionError(
                f"{self.path} at byte {offset}: {one_line(error)}; it changed while it was being read."
            ) from error

    def _read_header(self, line: bytes, digest: Any) -> Header:
        digest.update(line)
        try:
            return Header.model_validate_json(line)
        except ValueError as error:
            raise RecordedPerceptionError(
                f"{self.path} line 1 is not the header of a {FORMAT} file: {one_line(error)}."
            ) from error

    def _index(self, file: Any, digest: Any) -> None:
        seen: dict[tuple[int, int], int] = {}
        number, offset = 1, file.tell()
        while line := file.readline(MAX_LINE_BYTES):
            number += 1
            digest.update(line)
            if line.strip():
                mask = self._checked(line, number)
                first = seen.setdefault((mask.stamp_ns, mask.mask_index), number)
                if first != number:
                    raise self._wrong(number, f"mask {mask.mask_index} of stamp {mask.stamp_ns} is on line {first} too")
                self._offsets[mask.stamp_ns].append(offset)
            offset += len(line)

    def _checked(self, line: bytes, number: int) -> MaskLine:
        try:
            mask = MaskLine.model_validate_json(line)
            mask.check(self.header.feature_dim)
        except ValueError as error:
            raise self._wrong(number, one_line(error)) from error
        return mask

    def _wrong(self, number: int, what: str) -> RecordedPerceptionError:
        return RecordedPerceptionError(f"{self.path} line {number}: {what}. Correct or remove the line.")
