"""The operator's screen: a thread of its own writes what is shown there, so that a screen holds up nobody."""

from __future__ import annotations

import os
import select
import threading
from collections import deque
from collections.abc import Callable
from typing import TextIO

TEXTS_MAX = 500  # that wait for a screen which takes none
END_S = 1.0  # for the last ones, where the program ends


class Screen:
    """What is shown never waits, and raises nothing: the mission tells it things, and so does whoever presses STOP.

    A terminal takes nothing while its output is paused (Ctrl-S), its ssh is frozen or its pipe is full. What it does
    not take waits; of too much the oldest is left out, and that is said. lost: is told, on the writing thread, where
    the stream fails; nothing is shown from then on.
    """

    def __init__(self, stream: TextIO, lost: Callable[[Exception], None]) -> None:
        self.stream, self.terminal = stream, is_terminal(stream)
        self._write, self._lost = writer_of(stream), lost
        self._texts: deque[str] = deque()
        self._left_out = 0
        self._ended = self._busy = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="screen", daemon=True)
        self._thread.start()

    def show(self, text: str) -> None:
        """text: as it is written, with its line's end."""
        with self._changed:
            if self._ended:
                return
            if len(self._texts) == TEXTS_MAX:
                self._texts.popleft()
                self._left_out += 1
            self._texts.append(text)
            self._changed.notify_all()

    def settled(self, seconds: float) -> bool:
        """Wait so long until all is written; whether it is."""
        with self._changed:
            return self._changed.wait_for(lambda: not (self._texts or self._busy), seconds)

    def end(self) -> None:
        """Nothing more is shown; what waits has a moment left."""
        self.settled(END_S)
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def _run(self) -> None:
        while (text := self._next()) is not None:
            try:
                self._write(text)
            except (OSError, ValueError) as error:  # hung up, or closed
                with self._changed:
                    self._ended, self._busy = True, False
                    self._texts.clear()
                    self._changed.notify_all()
                self._lost(error)
                return

    def _next(self) -> str | None:
        with self._changed:
            self._busy = False
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._texts or self._ended)
            if not self._texts:
                return None
            self._busy = True
            missing, self._left_out = self._left_out, 0
            return (f"({missing} lines were not shown)\n" if missing else "") + self._texts.popleft()


def is_terminal(stream: TextIO | None) -> bool:
    """A pipe, a file and /dev/null are none; nor is what is closed already."""
    try:
        return stream is not None and stream.isatty()
    except (OSError, ValueError):
        return False


def writer_of(stream: TextIO) -> Callable[[str], object]:
    """Writes to the descriptor itself: a program cannot end while a thread is stuck inside a stream's buffer."""
    try:
        descriptor = stream.fileno()
    except (OSError, ValueError):  # nothing of the system is behind it, or it is closed

        def to_stream(text: str) -> None:
            stream.write(text)
            stream.flush()

        return to_stream

    def to_descriptor(text: str) -> None:
        rest = text.encode(stream.encoding or "utf-8", "backslashreplace")
        while rest:
            try:
                rest = rest[os.write(descriptor, rest) :]
            except BlockingIOError:  # another program made our terminal so
                select.select([], [descriptor], [])

    return to_descriptor
