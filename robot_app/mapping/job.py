"""What `openbelief map` is asked to do, what it tells on the way, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from logs.frames.reader import FrameReader, ReadOptions
from openbelief.memory import ObjectMemory
from openbelief.parameters import Parameters
from openbelief.rooms import Room
from openbelief.taken import Taken


@dataclass(frozen=True)
class MapJob:
    """perceptions: one spec for all recordings, or one for each. seed: of simulated perception. rooms: of the site.

    jobs: frames acquired at once; None: what the machine has cores for and the walk is long enough for.
    """

    recordings: list[Path]
    out: Path
    perceptions: list[str]
    parameters: Parameters = field(default_factory=Parameters)
    read: ReadOptions = field(default_factory=ReadOptions)
    force: bool = False
    seed: int = 0
    rooms: tuple[Room, ...] = ()
    jobs: int | None = None

    @property
    def partial(self) -> Path:
        return self.out.with_name(self.out.name + ".partial")


class Progress(Protocol):
    """Told how far mapping is; robot_app.progress has one for people."""

    def frames(self, recording: str, done: int, total: int, rates: Mapping[str, float] | None = None) -> None:
        """rates: frames a second of stages that run side by side."""
        ...

    def step(self, sentence: str) -> None: ...


@dataclass(frozen=True)
class MapResult:
    """taken: by all runs that it took. resumed: how many of its frames an earlier, interrupted one had done."""

    memory: ObjectMemory
    readers: list[FrameReader]
    taken: Taken
    resumed: int
    seconds: dict[str, float]
