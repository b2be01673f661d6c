"""A mission that hangs while its robot drives has no pulse, and the watchdog on the robot stops it."""

from __future__ import annotations

import pytest

from drivers.ports import Navigator
from drivers.watchdog.drive_liveness import UNWATCHED_S, DriveLiveness
from drivers.watchdog.heartbeat import Heartbeat
from openbelief.pose import Pose2

FAR = Pose2(5.0, 1.0, 0.0)


class Watched:
    """A pulse whose time is moved by hand."""

    def __init__(self, navigator) -> None:
        self.now_s = 0.0
        self.pulse = DriveLiveness(navigator, lambda: self.now_s)

    def after(self, seconds: float) -> bool:
        self.now_s += seconds
        return self.pulse.beats()


@pytest.fixture
def watched(rig) -> Watched:
    return Watched(rig.nav)


def test_a_goal_that_is_asked_for_beats_and_one_that_nobody_watches_does_not(rig, watched):
    assert isinstance(watched.pulse, Navigator)
    assert watched.pulse.send(FAR) is None
    for _ in range(5):
        assert watched.after(UNWATCHED_S)
        assert watched.pulse.result() is None
    assert not watched.after(UNWATCHED_S * 1.1)
    assert watched.pulse.result() is None and watched.pulse.beats()


def test_a_robot_that_stands_needs_no_watching(rig, watched):
    assert watched.after(60.0)  # before any goal
    watched.pulse.send(FAR)
    watched.pulse.cancel(because="enough")
    assert watched.after(60.0)
    watched.pulse.send(Pose2(1.5, 1.0, 0.0))
    while watched.pulse.result() is None:
        rig.clock.sleep(0.1)
    assert watched.after(60.0)


def test_the_heart_stops_with_the_pulse_and_beats_again_with_it(rig, watched, eventually):
    looked: list[bool] = []
    beats: list[bytes] = []

    def alive() -> bool:
        looked.append(watched.pulse.beats())
        return looked[-1]

    rig.link.subscribe("openbelief/heartbeat", beats.append)
    with Heartbeat(rig.link, alive=alive):
        eventually(lambda: len(beats) >= 2)
        watched.pulse.send(FAR)
        watched.now_s += 5.0
        eventually(lambda: looked[-3:] == [False] * 3)
        silent = len(beats)
        eventually(lambda: looked[-6:] == [False] * 6)
        assert len(beats) == silent
        watched.pulse.cancel(because="the mission is back")
        eventually(lambda: len(beats) > silent)
