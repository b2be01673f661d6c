"""What the operator's clients are told of, and who listens."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum


class Change(StrEnum):
    """What a listener is told of."""

    TOLD = "told"
    ASKED = "asked"
    ANSWERED = "answered"
    EXPIRED = "expired"
    STOPPED = "stopped"
    LEASE = "lease"
    QUEUE = "queue"
    MISSION = "mission"


@dataclass(frozen=True, slots=True)
class Notice:
    """A change, and a sentence for the screen ("" where the change says it all)."""

    change: Change
    sentence: str = ""


Listener = Callable[[Notice], None]


class Notices:
    """Tells every listener of every change, on the thread that made it. Listeners neither wait nor raise."""

    def __init__(self) -> None:
        self._listeners: tuple[Listener, ...] = ()
        self._lock = threading.Lock()

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Be told from now on; returns what ends it."""
        with self._lock:
            self._listeners = (*self._listeners, listener)

        def end() -> None:
            with self._lock:
                self._listeners = tuple(each for each in self._listeners if each is not listener)

        return end

    def tell(self, change: Change, sentence: str = "") -> None:
        for listener in self._listeners:
            listener(Notice(change, sentence))
