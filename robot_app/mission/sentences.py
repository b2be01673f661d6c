"""The sentences that wait for their mission, first come, first asked."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from logs.trial.journal import Entry


@dataclass(frozen=True, slots=True)
class Sentence:
    """What somebody asked for. order: its place among all that was said, STOPs included.

    notes: what the trial keeps of how it was asked, the sound of it perhaps.
    """

    text: str
    who: str
    how: str
    order: int
    notes: tuple[Entry, ...] = ()


class Sentences:
    """A queue that can end: nothing is taken after what was put before its end. The caller keeps threads apart."""

    def __init__(self) -> None:
        self._waiting: deque[Sentence] = deque()
        self.ended = False

    @property
    def waiting(self) -> tuple[Sentence, ...]:
        return tuple(self._waiting)

    def put(self, sentence: Sentence) -> None:
        self._waiting.append(sentence)

    def take(self) -> Sentence | None:
        return self._waiting.popleft() if self._waiting else None

    def drop(self) -> tuple[Sentence, ...]:
        """Empty it; what waited."""
        dropped = self.waiting
        self._waiting.clear()
        return dropped
