"""The files that one recording was split into: scanned once each, and joined where one goes on where another ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from logs.containers.recording import Recording
from logs.frames.scan import Scan, follows, joined, scan


@dataclass(frozen=True)
class Stretch:
    """Files without a gap between them: their logs in order, and what was found in all of them."""

    logs: list[Recording]
    found: Scan


class SplitRecording:
    """Transforms, calibrations and pictures at a border are shared by the files of a stretch."""

    def __init__(self, logs: Sequence[Recording], max_tf_gap_s: float) -> None:
        self.logs, self._max_tf_gap_s = list(logs), max_tf_gap_s

    @cached_property
    def scans(self) -> list[Scan]:
        """Of every file."""
        return [scan(log, self._max_tf_gap_s) for log in self.logs]

    def stretch_of(self, number: int) -> tuple[Stretch, int]:
        """The stretch that a file belongs to, and the file's number in it."""
        for first, stretch in self._stretches:
            if first <= number < first + len(stretch.logs):
                return stretch, number - first
        raise IndexError(number)

    @cached_property
    def _stretches(self) -> list[tuple[int, Stretch]]:
        starts = [i for i in range(len(self.logs)) if i == 0 or not follows(self.scans[i - 1], self.scans[i])]
        ends = [*starts[1:], len(self.logs)]
        return [(a, Stretch(self.logs[a:b], _one(self.scans[a:b]))) for a, b in zip(starts, ends, strict=True)]


def _one(scans: list[Scan]) -> Scan:
    return scans[0] if len(scans) == 1 else joined(scans)
