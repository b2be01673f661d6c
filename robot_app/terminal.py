"""The operator at a terminal: a yes before motion, STOP at any moment, one sentence at a time on the screen."""

from __future__ import annotations

import queue
import sys
import threading
import time
from typing import TextIO

from openbelief.phrase import printable

STOP_WORDS = ("stop", "s", "halt")
YES_WORDS = ("yes", "y")
NO_WORDS = ("no", "n")


class TerminalOperator:
    """Reads lines on a thread of its own, so that "stop" is heard while the robot drives.

    Use as a context manager around a mission; Ctrl-C is a STOP too (the caller hands it to `request_stop`).
    """

    def __init__(self, *, motion: str = "ask", source: TextIO | None = None, screen: TextIO | None = None) -> None:
        self._motion = motion
        self._source = source or sys.stdin
        self._screen = screen or sys.stderr
        self._lines: queue.Queue[str] = queue.Queue()
        self._stop_reason: str | None = None

    def __enter__(self) -> TerminalOperator:
        threading.Thread(target=self._read, name="operator", daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        pass  # the reader is a daemon: a blocking read of stdin cannot be interrupted

    def begin(self) -> None:
        """A new mission: an old STOP no longer counts (it never restarts motion either)."""
        self._stop_reason = None

    def request_stop(self, *, because: str) -> None:
        self._stop_reason = self._stop_reason or because

    def stop_requested(self) -> str | None:
        return self._stop_reason

    def tell(self, sentence: str) -> None:
        print(printable(sentence), file=self._screen, flush=True)

    def confirm(self, question: str, timeout_s: float) -> str:
        if self._motion == "allow":
            self.tell(f"{question} yes (the configuration allows motion)")
            return "yes"
        while not self._lines.empty():  # what was typed before the question is no answer to it
            self._lines.get_nowait()
        self.tell(f"{question} [yes/no, {timeout_s:.0f} s; stop at any time]")
        deadline = time.monotonic() + timeout_s
        while (left := deadline - time.monotonic()) > 0:
            if self._stop_reason:
                return "stop"
            try:
                answer = self._lines.get(timeout=min(left, 0.1))
            except queue.Empty:
                continue
            if answer == END_OF_INPUT:
                break  # nobody is there to answer
            if answer.lower() in YES_WORDS + NO_WORDS:
                return "yes" if answer.lower() in YES_WORDS else "no"
            self.tell(f"{answer!r} is neither yes nor no.")
        return "expired"

    def next_line(self) -> str | None:
        """The next typed line, None at the end of input; for the prompt between missions."""
        line = self._lines.get()
        return None if line == END_OF_INPUT else line

    def _read(self) -> None:
        for line in self._source:
            words = line.strip()
            if words.lower().rstrip("!.") in STOP_WORDS:
                self.request_stop(because="the operator said stop")
            else:
                self._lines.put(words)
        self._lines.put(END_OF_INPUT)


END_OF_INPUT = "\x04"
