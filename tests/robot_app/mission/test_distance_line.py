"""While the robot drives, the terminal says how far it still is; nothing of that line is left behind."""

from __future__ import annotations

import io

from logs.trial.records import Feedback, PlanarPose, Transition
from robot_app.mission.distance_line import DistanceLine
from robot_app.mission.screen import Screen

ARRIVED = Transition(source="navigate", event="arrived", target="verify", because="")


class Stream(io.StringIO):
    def __init__(self, *, terminal: bool) -> None:
        super().__init__()
        self._terminal = terminal

    def isatty(self) -> bool:
        return self._terminal


def drive(stream: Stream, seconds: int) -> str:
    """Feedback ten times a second, a tenth of a metre each, then the arrival."""
    screen = Screen(stream, lost=lambda error: None)
    line = DistanceLine(screen)
    for k in range(seconds * 10):
        pose = PlanarPose(x=k / 10, y=0.0, yaw=0.0)
        left_m = seconds - k / 10
        line.write(
            Feedback(
                stamp_ns=k * 10**8 + 1, pose=pose, distance_remaining_m=left_m, navigation_time_s=k / 10, recoveries=0
            )
        )
    line.write(ARRIVED)
    screen.end()
    return stream.getvalue()


def test_a_terminal_has_one_line_that_is_rewritten_and_cleared() -> None:
    shown = drive(Stream(terminal=True), 10)
    assert "10.0 m to go" in shown and "0.5 m to go" in shown and "\n" not in shown
    assert shown.count("m to go") == 20 and shown.endswith("\r\x1b[K")


def test_a_log_gets_a_line_now_and_then() -> None:
    assert drive(Stream(terminal=False), 12).splitlines() == ["12.0 m to go", "7.0 m to go", "2.0 m to go"]


class Gone(Stream):
    """A terminal that hung up: every flush fails, as the kernel says EIO."""

    def flush(self) -> None:
        raise OSError(5, "Input/output error")


def test_a_screen_that_went_away_ends_no_mission() -> None:
    drive(Gone(terminal=True), 2)
