"""The operator at a terminal: a yes before motion, STOP at any moment, one sentence at a time on the screen."""

from __future__ import annotations

import queue
import sys
import threading
import time
from typing import TextIO

from logs.structured import neutralise

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
        self._lines: queue.Queue[tuple[int, str] | None] = queue.Queue()  # None: the input has ended
        self._lines_read = self._line_given = self._first_line_after_stop = 0  # to tell what came before what
        self._ended = False
        self._stop_reason: str | None = None

    def __enter__(self) -> TerminalOperator:
        threading.Thread(target=self._read, name="operator", daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        pass  # the reader is a daemon: a blocking read of stdin cannot be interrupted

    def begin(self) -> None:
        """A new mission: a STOP of before its sentence no longer counts (it never restarts motion either)."""
        if self._line_given >= self._first_line_after_stop:
            self._stop_reason = None

    def request_stop(self, *, because: str) -> None:
        self._first_line_after_stop = self._lines_read + 1
        self._stop_reason = self._stop_reason or because

    def stop_requested(self) -> str | None:
        return self._stop_reason

    def tell(self, sentence: str) -> None:
        print(neutralise(sentence), file=self._screen, flush=True)

    def confirm(self, question: str, timeout_s: float) -> str:
        if self._motion == "allow":
            self.tell(f"{question} yes (the configuration allows motion)")
            return "yes"
        while not self._lines.empty():  # what was typed before the question is no answer to it
            self._next(timeout_s=0.0)
        self.tell(f"{question} [yes/no, {timeout_s:.0f} s; stop at any time]")
        deadline = time.monotonic() + timeout_s
        while (left := deadline - time.monotonic()) > 0:
            if self._stop_reason:
                return "stop"
            if self._ended:
                self.tell("Nobody can answer: the input has ended.")
                break
            answer = self._next(timeout_s=min(left, 0.1))
            if answer is None:
                continue
            if answer.lower() in YES_WORDS + NO_WORDS:
                return "yes" if answer.lower() in YES_WORDS else "no"
            self.tell(f"{answer!r} is neither yes nor no.")
        return "expired"

    def next_line(self) -> str | None:
        """The next typed line, None at the end of input; for the prompt between missions."""
        while not self._ended:
            line = self._next()
            if line is not None and line.lower() in YES_WORDS + NO_WORDS:
                self.tell("Nothing is being asked now: say what to look for, or give an empty line to end.")
            elif line is not None:
                return line
        return None

    def _next(self, timeout_s: float | None = None) -> str | None:
        """The next line, None where there is none in time or the input has ended (then `_ended` says so)."""
        try:
            entry = self._lines.get(timeout=timeout_s) if timeout_s != 0.0 else self._lines.get_nowait()
        except queue.Empty:
            return None
        if entry is None:
            self._ended = True
            return None
        self._line_given, line = entry
        return line

    def _read(self) -> None:
        try:
            for line in self._source or ():
                words = line.strip()
                self._lines_read += 1
                if words.lower().rstrip("!.") in STOP_WORDS:
                    self.request_stop(because="the operator said stop")
                else:
                    self._lines.put((self._lines_read, words))
        except (OSError, ValueError) as error:  # a terminal that went away, an input that was closed
            self.tell(f"Nothing more can be typed here: {error}")
        self._lines.put(None)
