"""The sentences that wait for their mission, first come, first asked."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from logs.trial.journal import Entry
from robot_app.mission.lease import Refused

QUEUE_MAX = 8
SENTENCE_MAX = 300  # characters


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
        self._said = 0
        self.ended = False

    @property
    def waiting(self) -> tuple[Sentence, ...]:
        return tuple(self._waiting)

    def next_order(self) -> int:
        """The place of what is said now among all that was said."""
        self._said += 1
        return self._said

    def put(self, text: str, who: str, how: str, notes: tuple[Entry, ...] = ()) -> Sentence:
        """Raises Refused where too much waits already, or the text is too long."""
        order = self.next_order()
        if len(text) > SENTENCE_MAX or len(self._waiting) >= QUEUE_MAX:
            raise Refused(f"Too much: {QUEUE_MAX} sentences of {SENTENCE_MAX} characters may wait.")
        self._waiting.append(Sentence(text, who, how, order, notes))
        return self._waiting[-1]

    def take(self) -> Sentence | None:
        return self._waiting.popleft() if self._waiting else None

    def drop(self) -> tuple[Sentence, ...]:
        """Empty it; what waited."""
        dropped = self.waiting
        self._waiting.clear()
        return dropped
