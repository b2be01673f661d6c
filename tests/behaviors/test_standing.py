"""That the robot stands is seen, never inferred: what a navigator says, against where the robot is."""

from __future__ import annotations

import pytest

from behaviors.events import End
from behaviors.standing import Stillness
from drivers.ports import NavigationResult, NavigationStatus, PoseUnavailable, Reaction, SafetyVerdict, StampedPose
from logs.trial import records
from openbelief.pose import Pose2

ABORTED = NavigationResult(NavigationStatus.ABORTED, "Nav2 gave up")
UNANSWERED = NavigationResult(NavigationStatus.STILL_MOVING, "the cancel was not taken")


@pytest.fixture
def s(stage, make):
    return stage([make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher")])


def walking(s, metres_per_s: float):
    """The robot is seen to walk on, whatever its navigator says."""
    start_ns = s.clock.now_ns()
    return lambda robot: Pose2(robot.x + metres_per_s * (s.clock.now_ns() - start_ns) / 1e9, robot.y, robot.yaw)


def test_a_robot_that_drives_on_after_succeeded_is_halted_and_named(s):
    s.look_at = walking(s, 0.4)
    outcome = s.run()
    assert (outcome.end, s.perceived) == (End.FAULT, 0)
    assert outcome.reason == "goal reached, but the robot moves on; all goals were cancelled"
    assert len(s.cancelled) == 1


def test_a_robot_that_turns_on_the_spot_does_not_stand(s):
    s.look_at = lambda robot: Pose2(robot.x, robot.y, robot.yaw + 0.6 * s.clock.now_ns() / 1e9 % 6.0)
    assert s.run().end is End.FAULT and "moves on" in s.outcome.reason


def test_a_robot_that_stands_elsewhere_has_not_arrived_and_its_goal_is_cancelled(s):
    s.look_at = lambda robot: Pose2(robot.x + 0.8, robot.y, robot.yaw)
    outcome = s.run()
    assert outcome.end is End.NAVIGATION_FAILED and s.perceived == 0
    assert "the robot stands 0.8 m from it; all goals were cancelled" in outcome.reason + " ".join(s.told)
    assert s.cancelled and len(s.sent) == 2  # from its other goal pose too


def test_the_site_says_how_near_is_near_enough(s):
    s.look_at = lambda robot: Pose2(robot.x + 0.8, robot.y, robot.yaw)
    s.policy = s.policy.from_dict(s.policy.to_dict() | {"goal_tolerance_m": 1.0})
    assert s.run().end is End.CONFIRMED


def test_an_abort_of_a_robot_that_drives_on_is_no_reason_to_send_it_elsewhere(s, make):
    s.drives = [make.drive(end=ABORTED)]
    s.look_at = walking(s, 0.4)
    outcome = s.run()
    assert outcome.end is End.FAULT and "Nav2 gave up, but the robot moves on" in outcome.reason
    assert len(s.sent) == 1 and s.cancelled


def test_a_robot_that_still_comes_to_a_stand_is_waited_for(s):
    begun_ns = s.clock.now_ns()

    def braking(robot: Pose2) -> Pose2:
        left_s = max(1.5 - (s.clock.now_ns() - begun_ns) / 1e9, 0.0)
        return Pose2(robot.x - 0.15 * left_s**2, robot.y, robot.yaw)

    s.look_at = braking
    assert s.run().end is End.CONFIRMED and s.cancelled == []


def test_a_pose_that_stands_still_is_no_robot_that_stands(s, monkeypatch):
    frozen_ns = s.clock.now_ns()
    ports = s.ports
    monkeypatch.setattr(type(ports.poses), "stamped_pose", lambda self, age: StampedPose(frozen_ns, self.stage.robot))
    outcome = s.run()
    assert (
        outcome.end is End.FAULT and "nobody can tell whether the robot stands: its pose stands still" in outcome.reason
    )
    assert s.cancelled


def test_a_pose_that_is_lost_at_arrival_halts_the_robot(s, monkeypatch):
    def lost(self, age):
        raise PoseUnavailable("No transforms join 'map' and 'base_link'.")

    monkeypatch.setattr(type(s.ports.poses), "stamped_pose", lost)
    outcome = s.run()
    assert outcome.end is End.FAULT and "No transforms join" in outcome.reason and s.cancelled


def test_a_stop_while_the_robot_is_looked_at_cancels_every_goal(s):
    s.look_at = walking(s, 0.4)
    s.stop_when = lambda: len(s.of(records.PoseLook)) >= 5
    assert s.run().end is End.CANCELLED and s.cancelled == ["STOP pressed"]


def test_a_hold_while_the_robot_is_looked_at_cancels_it(s):
    hold = SafetyVerdict(Reaction.HOLD, "cloud", "No new cloud.")
    s.verdict = lambda goal: hold if len(s.of(records.PoseLook)) == 5 else SafetyVerdict()
    s.run()
    assert "No new cloud." in s.cancelled


@pytest.mark.parametrize("state", ["query", "await_approval", "verify"])
def test_a_stop_in_any_state_cancels_every_goal(s, state):
    s.stop_when = {
        "query": lambda: True,
        "await_approval": lambda: bool(s.asked),
        "verify": lambda: s.perceived > 0,
    }[state]
    assert s.run().end is End.CANCELLED
    assert s.cancelled == ["STOP pressed"]
    [answer] = s.of(records.HaltAnswer)
    assert answer.status == NavigationStatus.CANCELED


@pytest.mark.parametrize("state", ["await_approval", "verify"])
def test_a_stop_that_nobody_acknowledges_is_not_reported_as_done(s, state, monkeypatch):
    monkeypatch.setattr(type(s.ports.navigator), "halt", lambda self, *, because: UNANSWERED)
    s.stop_when = {"await_approval": lambda: bool(s.asked), "verify": lambda: s.perceived > 0}[state]
    outcome = s.run()
    assert outcome.end is End.FAULT
    assert "STOP pressed" in outcome.reason and "use the remote" in outcome.reason


# The rule alone


def seen(*looks: tuple[float, float]) -> Stillness:
    """Looks of (seconds, metres)."""
    still = Stillness()
    for seconds, x in looks:
        still.see(StampedPose(round(seconds * 1e9), Pose2(x, 0.0, 0.0)))
    return still


def test_half_a_second_of_looks_that_do_not_move_is_standing():
    assert seen(*((0.1 * k, 1.0) for k in range(6))).stands
    assert not seen(*((0.1 * k, 1.0) for k in range(5))).stands  # 0.4 s


def test_localisation_that_wanders_slowly_is_standing_and_a_slow_walk_is_not():
    assert seen(*((0.1 * k, 0.004 * k) for k in range(20))).stands  # 0.04 m/s
    assert not seen(*((0.1 * k, 0.006 * k) for k in range(20))).stands


def test_two_looks_are_not_enough_and_a_clock_that_was_set_back_begins_anew():
    assert not seen((0.0, 1.0), (0.6, 1.0)).stands
    assert not seen((10.0, 1.0), (10.3, 1.0), (0.0, 1.0), (0.3, 1.0)).stands


def test_a_robot_that_nobody_saw_does_not_stand():
    assert not Stillness().stands and Stillness().last is None
