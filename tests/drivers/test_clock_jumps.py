"""The robot's clock is set under way, ahead and back, over real sessions: named while wrong, followed when right."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from behaviors.safety_policy import SafetyPolicy
from behaviors.supervision import Sources, Supervision
from drivers.ports import Reaction, StaleData
from drivers.topics import CAMERA_INFO, COLOR, DEPTH, LIDAR, TF
from openbelief.pose import Pose2
from sim_fakes.wire.faults import shifted

HOUR_S = 3600.0
STAMPED = (COLOR, DEPTH, CAMERA_INFO, LIDAR, TF)
READ = (
    lambda rig: rig.camera.latest(1.5),
    lambda rig: rig.lidar.latest(1.0),
    lambda rig: rig.poses.robot_pose(0.5),
)


def set_clock(rig, by_s: float) -> None:
    """The robot's clock is off by so much from now on."""
    rig.graph.sensor_faults.spoiled |= {topic.name: shifted(topic, by_s) for topic in STAMPED}


@pytest.mark.parametrize("by_s", [HOUR_S, -HOUR_S, 3.0, -3.0])
def test_a_robots_clock_that_is_wrong_is_named_and_one_that_is_right_again_is_used_at_once(rig, by_s):
    words = "ahead of our clock: synchronise the clocks" if by_s > 0 else "old, more than"
    for _ in range(2):
        set_clock(rig, by_s)
        rig.clock.sleep(2.0)
        for read in READ:
            with pytest.raises(StaleData, match=words):
                read(rig)
        set_clock(rig, 0.0)
        rig.clock.sleep(1.5)
        for read in READ:
            read(rig)


@pytest.mark.parametrize("by_s", [HOUR_S, -HOUR_S])
def test_where_the_robot_was_at_an_images_stamp_is_known_by_the_robots_own_clock_whatever_ours_says(rig, by_s):
    set_clock(rig, by_s)
    rig.clock.sleep(2.0)
    frame = rig.camera.latest(1e9)
    assert abs(frame.stamp_ns / 1e9 - rig.clock.now_ns() / 1e9 - by_s) < 1.5
    assert rig.poses.transform_at(frame.stamp_ns, "base_link")[:2, 3] == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize("by_s", [HOUR_S, -HOUR_S])
def test_the_supervisor_takes_no_step_of_the_robots_clock_for_a_sensor_that_is_silent_or_old(rig, by_s):
    """Robot and map stand still here: only their stamps are news."""
    standing = SimpleNamespace(robot_pose=lambda _max_age_s: Pose2(1.0, 1.0, 0.0))
    sources = Sources(clock=rig.clock, poses=standing, map=rig.map, camera=rig.camera, lidar=rig.lidar)
    supervision = Supervision(sources, SafetyPolicy(stuck_s=1e6))
    for offset_s in (0.0, by_s, 0.0):
        set_clock(rig, offset_s)
        for _ in range(80):
            rig.clock.sleep(0.05)
            verdict = supervision.verdict(Pose2(2.0, 2.0, 0.0))
            assert verdict.reaction is Reaction.GO, verdict
