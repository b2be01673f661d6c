"""What the supervisor is told of live ports."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from behaviors.safety_policy import SafetyPolicy
from behaviors.supervision import Sources, Supervision
from drivers.clock import SimClock
from drivers.ports import BatteryState, CameraFrame, LidarCloud, PortError, Reaction, StaleData
from openbelief.observation import Intrinsics
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid

GOAL = Pose2(2.0, 2.0, 0.0)
K = Intrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)


@pytest.fixture
def site(stage, make):
    """Live sources that a test can break, and `ask(seconds, goal)`: the verdict after that much time."""
    s = SimpleNamespace(clock=SimClock(0), broken=set(), frozen=None, same=False, charge=0.9, at=(-1.0, -1.0))

    def stamped(name, sample):
        if name in s.broken:
            raise StaleData(f"no {name}")
        return sample

    def stamp() -> int:
        return s.clock.now_ns() if s.frozen is None else s.frozen

    def noise() -> np.ndarray:
        return np.random.default_rng(0 if s.same else stamp()).random((64, 3)).astype(np.float32)

    def frame(max_age_s):
        depth = noise()[:48, :1] * np.ones((48, 64), np.float32)
        return stamped("camera", CameraFrame(stamp(), np.zeros((48, 64, 3), np.uint8), depth, K, "camera"))

    memory = stage([make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher")]).memory
    sources = Sources(
        clock=s.clock,
        poses=SimpleNamespace(robot_pose=lambda age: stamped("pose", Pose2(1.0, 1.0, 0.0))),
        map=SimpleNamespace(latest=lambda: stamped("map", OccupancyGrid(np.zeros((200, 200), np.int8), 0.05, s.at))),
        camera=SimpleNamespace(latest=frame),
        lidar=SimpleNamespace(latest=lambda age: stamped("cloud", LidarCloud(stamp(), noise(), "livox_frame"))),
        battery=SimpleNamespace(latest=lambda age: stamped("battery", BatteryState(stamp(), s.charge))),
        disk_free_bytes=lambda: 10**11,
        memory=memory,
    )
    supervision = Supervision(sources, SafetyPolicy())

    def ask(seconds=0.05, goal=GOAL):
        s.clock.sleep(seconds)
        return supervision.verdict(goal)

    s.ask = ask
    return s


def test_with_everything_fresh_the_robot_may_go(site):
    assert site.ask(goal=None).reaction is Reaction.GO
    assert [site.ask().reaction for _ in range(200)] == [Reaction.GO] * 200


@pytest.mark.parametrize(
    ("name", "seconds", "condition"),
    [("pose", 0.1, "pose"), ("cloud", 1.2, "cloud"), ("camera", 2.2, "camera"), ("battery", 0.1, "battery unknown")],
)
def test_a_port_that_raises_is_missing_data_not_an_error(site, name, seconds, condition):
    site.ask()
    site.broken.add(name)
    while site.clock.now_ns() < seconds * 1e9:
        verdict = site.ask()
    assert verdict.condition == condition


def test_stamps_that_stand_still_are_caught_though_the_port_gives_data(site):
    site.ask()
    site.frozen = site.clock.now_ns()
    assert [site.ask().condition for _ in range(25)][-1] == "cloud"


def test_the_same_points_under_new_stamps_are_caught(site):
    site.ask()
    site.same = True
    assert [site.ask().condition for _ in range(63)][-1] == "cloud"


def test_a_memory_that_lies_off_the_map_is_refused_before_the_mission(site):
    site.at = (50.0, 50.0)
    verdict = site.ask(goal=None)
    assert verdict.condition == "memory and map" and "1 of 1 objects lie off the map" in verdict.sentence


def test_a_defect_of_a_port_is_not_taken_for_missing_data(site):
    site.at = None
    with pytest.raises(TypeError):
        site.ask(goal=None)
    assert issubclass(StaleData, PortError)
