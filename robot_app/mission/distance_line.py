"""How far the robot still has to go, while it drives: one line, rewritten on a terminal, now and then elsewhere."""

from __future__ import annotations

from typing import TextIO

from logs.trial.journal import Attached
from logs.trial.records import Feedback, Record, Transition

EVERY_S = {True: 0.5, False: 5.0}  # by whether the screen is a terminal


class DistanceLine:
    """A Journal that shows the navigator's feedback; time is the feedback's own."""

    def __init__(self, screen: TextIO) -> None:
        self._screen, self._live = screen, screen.isatty()
        self._next_ns, self._open, self._lost = 0, False, False

    def write(self, record: Record, attached: Attached = None) -> None:  # noqa: ARG002 - pictures are not shown here
        if isinstance(record, Feedback):
            self._show(record)
        elif isinstance(record, Transition):
            self._close()

    def _put(self, text: str) -> None:
        """Never raises: that the terminal is lost is for `Terminal` to notice, whose stop has the right words."""
        if self._lost:
            return
        try:
            self._screen.write(text)
            self._screen.flush()
        except (OSError, ValueError):
            self._lost = True

    def _show(self, feedback: Feedback) -> None:
        if feedback.stamp_ns < self._next_ns:
            return
        self._next_ns = feedback.stamp_ns + round(EVERY_S[self._live] * 1e9)
        words = f"{feedback.distance_remaining_m:.1f} m to go"
        self._put(f"\r\x1b[K{words}" if self._live else f"{words}\n")
        self._open = self._live

    def _close(self) -> None:
        self._next_ns = 0
        if self._open:
            self._put("\r\x1b[K")
        self._open = False
