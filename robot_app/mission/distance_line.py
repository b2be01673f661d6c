"""How far the robot still has to go, while it drives: one line, rewritten on a terminal, now and then elsewhere."""

from __future__ import annotations

from logs.trial.journal import Attached
from logs.trial.records import Feedback, Record, Transition
from robot_app.mission.screen import Screen

EVERY_S = {True: 0.5, False: 5.0}  # by whether the screen is a terminal


class DistanceLine:
    """A Journal that shows the navigator's feedback; time is the feedback's own."""

    def __init__(self, screen: Screen) -> None:
        self._screen, self._live = screen, screen.terminal
        self._next_ns, self._open = 0, False

    def write(self, record: Record, attached: Attached = None) -> None:  # noqa: ARG002 - pictures are not shown here
        if isinstance(record, Feedback):
            self._show(record)
        elif isinstance(record, Transition):
            self._close()

    def _show(self, feedback: Feedback) -> None:
        if feedback.stamp_ns < self._next_ns:
            return
        self._next_ns = feedback.stamp_ns + round(EVERY_S[self._live] * 1e9)
        words = f"{feedback.distance_remaining_m:.1f} m to go"
        self._screen.show(f"\r\x1b[K{words}" if self._live else f"{words}\n")
        self._open = self._live

    def _close(self) -> None:
        self._next_ns = 0
        if self._open:
            self._screen.show("\r\x1b[K")
        self._open = False
