"""The Navigator port over real Zenoh sessions, against the simulated Nav2, when all goes well."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.ports import LinkLost, NavigationStatus, PortError
from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.messages import DISTRIBUTIONS
from openbelief.pose import Pose2

GOAL = Pose2(3.5, 3.0, 1.0)


def test_a_goal_is_driven_to_and_reported(rig):
    assert rig.nav.unavailable() is None
    assert rig.nav.send(GOAL) is None
    assert rig.nav.result() is None
    result = rig.until_end()
    assert result.status == NavigationStatus.SUCCEEDED
    assert rig.robot.pose.distance_to(GOAL) < 0.1
    assert rig.nav.result() == result, "asked again: the same"


def test_feedback_tells_the_way_left(rig):
    rig.nav.send(GOAL)
    assert rig.nav.feedback() is None, "none before the first"
    rig.clock.sleep(2.0)
    early = rig.nav.feedback()
    rig.until_end()
    late = rig.nav.feedback()
    assert early.distance_remaining_m > late.distance_remaining_m >= 0
    assert early.stamp_ns < late.stamp_ns and early.navigation_time_s < late.navigation_time_s
    assert late.pose.distance_to(GOAL) < 0.5


def test_a_drive_takes_its_time_by_the_simulated_clock(rig):
    rig.nav.send(Pose2(5.0, 1.0, 0.0))
    simulated_ns = rig.clock.now_ns()
    rig.until_end()
    assert (rig.clock.now_ns() - simulated_ns) / 1e9 > 8.0, "4 m at 0.5 m/s"


def test_the_plan_has_the_length_of_the_way(rig):
    plan = rig.nav.plan(Pose2(4.0, 1.0, 0.0))
    assert plan.length_m == pytest.approx(3.0, abs=0.2)
    assert not rig.robot.moving, "asking moves nothing"


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        (Pose2(5.5, 3.5, 0.0), "no way"),
        (Pose2(50.0, 1.0, 0.0), "outside the map"),
        (Pose2(0.05, 2.0, 0.0), "occupied"),
    ],
)
def test_a_plan_without_a_way_says_why(rig, goal, words):
    plan = rig.nav.plan(goal)
    assert plan.length_m is None
    assert words in plan.reason


def test_a_goal_without_a_way_is_aborted_with_its_code(rig):
    assert rig.nav.send(Pose2(5.5, 3.5, 0.0)) is None, "Nav2 accepts first"
    result = rig.until_end()
    assert (result.status, result.code) == (NavigationStatus.ABORTED, 208)


def test_cancel_stops_the_robot_and_carries_the_reason(rig):
    rig.nav.send(GOAL)
    rig.clock.sleep(1.0)
    result = rig.nav.cancel(because="the operator said stop")
    assert result.status == NavigationStatus.CANCELED
    assert "the operator said stop" in result.reason
    assert not rig.robot.moving
    assert rig.nav.result() == result


def test_cancel_after_the_end_tells_that_end(rig):
    rig.nav.send(GOAL)
    end = rig.until_end()
    assert rig.nav.cancel(because="too late") == end


def test_cancel_without_a_goal_is_harmless(rig):
    assert rig.nav.cancel(because="to be sure").status == NavigationStatus.CANCELED


def test_a_second_goal_is_refused_while_one_is_under_way(rig):
    rig.nav.send(GOAL)
    with pytest.raises(PortError, match="cancel it"):
        rig.nav.send(GOAL)


def test_after_an_end_the_next_goal_is_taken(rig):
    rig.nav.send(GOAL)
    rig.nav.cancel(because="changed our mind")
    assert rig.nav.send(Pose2(2.0, 2.0, 0.0)) is None
    assert rig.until_end().status == NavigationStatus.SUCCEEDED


def test_the_same_seed_gives_the_same_drive_twice(make_rig):
    def drive():
        made = make_rig(seed=3)
        made.start()
        seen = [made.nav.plan(GOAL)]
        made.nav.send(GOAL)
        while (result := made.nav.result()) is None:
            made.clock.sleep(0.1)
            seen.append((made.clock.now_ns(), made.nav.feedback(), made.poses.robot_pose(0.5)))
            seen.append(made.camera.latest(2.0).stamp_ns)
        return [*seen, result]

    assert drive() == drive()


def test_everything_works_below_a_namespace(make_rig):
    made = make_rig(keys=BridgeKeys("/g1"))
    made.start()
    made.nav.send(GOAL)
    assert made.until_end().status == NavigationStatus.SUCCEEDED
    assert made.camera.latest(2.0).color.shape == (480, 640, 3)


@pytest.mark.parametrize("by_hand", [False, True])
@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_every_distribution_drives_plans_and_fails(make_rig, distribution, by_hand):
    made = make_rig(distribution=distribution, expected=distribution if by_hand else "auto")
    made.start()
    assert made.nav.plan(GOAL).length_m > 2.0
    made.nav.send(GOAL)
    assert made.until_end().status == NavigationStatus.SUCCEEDED
    assert made.nav.feedback() is not None
    made.nav.send(Pose2(5.5, 3.5, 0.0))
    assert made.until_end().status == NavigationStatus.ABORTED


@pytest.mark.parametrize(
    ("distribution", "told"),
    [("humble", "humble"), ("jazzy", "jazzy"), ("kilted", "jazzy"), ("lyrical", "lyrical")],
)
def test_one_drive_tells_the_distribution(make_rig, distribution, told):
    made = make_rig(distribution=distribution)
    made.start()
    assert len(made.nav.distributions) > 1, "nothing that differs was said yet"
    made.nav.send(GOAL)
    made.until_end()
    assert made.nav.distributions == (told,)


def test_a_nav2_that_comes_back_as_another_distribution_is_still_understood(make_rig):
    made = make_rig(distribution="humble")
    made.start()
    made.nav.send(GOAL)
    made.until_end()
    made.graph.nav2.speak("jazzy")
    made.nav.send(Pose2(5.5, 3.5, 0.0))
    result = made.until_end()
    assert (result.status, result.code) == (NavigationStatus.ABORTED, 208)
    assert "humble" not in made.nav.distributions


def test_a_distribution_set_wrong_is_an_end_all_the_same(make_rig):
    made = make_rig(distribution="humble", expected="jazzy")
    made.start()
    made.nav.send(GOAL)
    end = made.until_end()
    assert end.status == NavigationStatus.LOST and "its result message was lost" in end.reason
    assert not made.robot.moving
    with pytest.raises(LinkLost, match="cannot be read"):
        made.nav.plan(GOAL)


class OtherKeys:
    """Keys as rmw_zenoh builds them, with Humble's word for a type's hash; its attachments are another matter."""

    def topic(self, topic):
        return f"0/{topic.name.strip('/')}/{self._type(topic.type_name)}"

    def service(self, service):
        return f"0/{service.name.strip('/')}/{self._type(service.type_name)}"

    def action(self, action, part):
        return f"0/{action.name.strip('/')}/_action/{part}/{self._type(f'{action.type_name}_{part}')}"

    def bridge_token(self, zid):
        return f"@ros2_lv/0/{zid}/node"

    def action_token(self, action, zid="*"):
        return f"@ros2_lv/0/{zid}/action/{action.name.strip('/').replace('/', '%')}"

    def _type(self, name):
        package, kind, short = name.split("/")
        return f"{package}::{kind}::dds_::{short}_/TypeHashNotSupported"


def test_keys_of_another_bridge_are_another_class(make_rig):
    made = make_rig(keys=OtherKeys())
    made.start()
    made.nav.send(GOAL)
    assert made.until_end().status == NavigationStatus.SUCCEEDED
    assert made.nav.plan(Pose2(2.0, 1.0, 0.0)).length_m > 1.0
    assert made.camera.latest(2.0).color.shape == (480, 640, 3)


def test_goals_carry_stamp_zero_so_that_skewed_clocks_do_no_harm(rig):
    from drivers.ros.convert import pose_message

    stamp = pose_message(GOAL).header.stamp
    assert (stamp.sec, stamp.nanosec) == (0, 0)


def test_the_poses_reported_are_the_robots(rig):
    rig.nav.send(GOAL)
    rig.until_end()
    reported = rig.poses.robot_pose(0.5)
    assert np.allclose([reported.x, reported.y], rig.robot.believed_pose.xy, atol=1e-9)
