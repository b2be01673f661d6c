"""A trial's frames looked at again: what perception says of them now, beside what it said then."""

from __future__ import annotations

from dataclasses import dataclass

from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.ports import Perception


@dataclass(frozen=True)
class FrameComparison:
    """One arrival frame. before: the trial's masks; now: those of the other perception."""

    stamp_ns: int
    before: list[Mask]
    now: list[Mask]


class PerceptionComparison:
    """The Perception port. The trial's own masks are consumed as well, so that every input keeps its place.

    looks: the frames so far. failure: what the other perception raised, None while it works.
    """

    def __init__(self, recorded: Perception, other: Perception) -> None:
        self._recorded, self._other = recorded, other
        self.id, self.feature_text_aligned = other.id, other.feature_text_aligned
        self.looks: list[FrameComparison] = []
        self.failure: Exception | None = None

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        before = self._recorded.perceive(frame)
        try:
            now = self._other.perceive(frame)
        except Exception as error:
            self.failure = error
            raise
        self.looks.append(FrameComparison(frame.stamp_ns, before, now))
        return now
