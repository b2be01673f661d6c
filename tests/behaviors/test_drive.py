"""One drive of a mission: however it ends, it has a name, and a goal that may be under way is cancelled."""

from __future__ import annotations

import pytest

from behaviors.events import End
from drivers.ports import NavigationResult, NavigationStatus, PoseUnavailable


def test_stop_while_driving_cancels_the_goal_within_a_tenth_of_a_second(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(end=None)]
    pressed_ns = s.clock.now_ns() + 3_000_000_000
    s.stop_when = lambda: s.clock.now_ns() >= pressed_ns
    assert s.run().end is End.CANCELLED
    assert s.cancelled == ["STOP pressed"]
    assert s.clock.now_ns() - pressed_ns <= 100_000_000


def test_an_unanswered_cancel_sends_the_operator_to_the_remote(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(end=None, cancel=NavigationResult(NavigationStatus.STILL_MOVING, "no answer in 1 s"))]
    s.stop_when = lambda: len(s.sent) == 1
    outcome = s.run()
    assert outcome.end is End.FAULT
    assert "the robot may still be moving: use the remote" in outcome.reason
    assert "use the remote" in s.told[-1]


def test_a_drive_that_never_ends_is_cancelled_and_counts_as_unreached(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(end=None)]
    outcome = s.run()
    assert outcome.end is End.CONFIRMED
    assert s.cancelled == ["no arrival within 180 s"] and len(s.sent) == 2


def test_a_lost_link_is_a_fault_and_the_goal_is_cancelled_still(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(end=NavigationResult(NavigationStatus.LOST, "the bridge went away"))]
    outcome = s.run()
    assert outcome.end is End.FAULT and "the bridge went away" in outcome.reason
    assert len(s.cancelled) == 1


@pytest.mark.parametrize("status", [NavigationStatus.CANCELED, NavigationStatus.PREEMPTED])
def test_somebody_elses_hand_on_the_robot_ends_the_mission(stage, extinguisher, make, status):
    s = stage([extinguisher])
    s.drives = [make.drive(end=NavigationResult(status, "another goal came from RViz"))]
    outcome = s.run()
    assert (outcome.end, outcome.reason) == (End.CANCELLED, "another goal came from RViz")
    assert len(s.sent) == 1


def test_a_rejected_goal_is_tried_from_the_next_pose(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(rejected=NavigationResult(NavigationStatus.REJECTED, "goal rejected"))]
    assert s.run().end is End.CONFIRMED
    assert len(s.sent) == 2


@pytest.mark.parametrize("error", [RuntimeError("boom"), PoseUnavailable("no transform")])
def test_an_exception_while_driving_cancels_the_goal_and_ends_in_fault(stage, extinguisher, make, error):
    s = stage([extinguisher])
    s.drives = [make.drive(raises=error)]
    outcome = s.run()
    assert outcome.end is End.FAULT and str(error) in outcome.reason
    assert len(s.cancelled) == 1


def test_an_exception_whose_cancel_fails_too_says_that_the_robot_may_move(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(raises=RuntimeError("boom"), cancel_raises=RuntimeError("link down"))]
    outcome = s.run()
    assert outcome.end is End.FAULT
    assert "boom" in outcome.reason and "use the remote" in outcome.reason


def test_an_interrupt_from_the_keyboard_cancels_the_goal_and_goes_on(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(raises=KeyboardInterrupt())]
    with pytest.raises(KeyboardInterrupt):
        s.run()
    assert len(s.cancelled) == 1
