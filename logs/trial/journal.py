"""Where a mission writes what it consumed and decided: to a file (logs.trial.writer) or to a list."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol, TypeAlias

from drivers.ports import CameraFrame, LidarCloud
from logs.trial.records import Record
from openbelief.traversability import OccupancyGrid


@dataclass(frozen=True)
class Sound:
    """What was said, as a WAV file."""

    wav: bytes


Attached: TypeAlias = CameraFrame | LidarCloud | OccupancyGrid | Sound | None


@dataclass(frozen=True)
class Entry:
    """A record, with the images, points, grid or sound that it is about. log_time_ns: when it was written, else 0."""

    record: Record
    attached: Attached = None
    log_time_ns: int = 0


class Journal(Protocol):
    def write(self, record: Record, attached: Attached = None) -> None:
        """Keep one record; what a decision saw comes before the decision."""
        ...


@dataclass(frozen=True)
class Tee:
    """One journal that is several: the first one keeps a record before the next one sees it."""

    journals: tuple[Journal, ...]

    def write(self, record: Record, attached: Attached = None) -> None:
        for journal in self.journals:
            journal.write(record, attached)


@dataclass
class ListJournal:
    """A journal in memory."""

    entries: list[Entry] = field(default_factory=list)

    def write(self, record: Record, attached: Attached = None) -> None:
        self.entries.append(Entry(record, attached))

    @property
    def decisions(self) -> list[Record]:
        return [entry.record for entry in self.entries if entry.record.role == "decision"]
