"""What a cancel and a halt come to, however Nav2 answers: the robot stands, or the operator is warned."""

from __future__ import annotations

import threading
from collections import Counter

import pytest

from drivers.nav2.cancelling import CANCEL_PAUSE_S
from drivers.nav2.limits import Nav2Limits
from drivers.ports import NavigationResult, NavigationStatus
from openbelief.pose import Pose2
from sim_fakes.wire.faults import ALWAYS

GOAL = Pose2(3.5, 3.0, 1.0)
USE_THE_REMOTE = "use the remote"
NEVER_SENT = NavigationResult(NavigationStatus.CANCELED, "No goal was under way.")


@pytest.mark.parametrize("code", [0, 1])
def test_a_refused_cancel_ends_in_a_warning(under_way, code):
    """rclcpp's servers refuse with code 1, rclpy's with code 0 and no goal in the answer."""
    under_way.graph.nav2_faults.cancel_code = code
    result = under_way.nav.cancel(because="stop")
    assert result.status == NavigationStatus.STILL_MOVING and USE_THE_REMOTE in result.reason


def test_a_cancel_of_a_forgotten_goal_cancels_everything(under_way):
    under_way.graph.nav2_faults.silent = True
    under_way.graph.nav2.restart()
    result = under_way.nav.cancel(because="stop")
    assert result.status == NavigationStatus.LOST and "all goals were cancelled" in result.reason


def test_a_cancel_that_comes_too_late_tells_how_the_goal_ended(rig):
    rig.nav.send(GOAL)
    rig.clock.sleep(30.0)
    assert not rig.robot.moving
    assert rig.nav.cancel(because="stop").status == NavigationStatus.SUCCEEDED


@pytest.mark.parametrize("fault", ["lost", "empty", "garbage"])
def test_a_cancel_that_is_not_answered_tries_all_goals_then_warns(under_way, fault):
    getattr(under_way.graph.nav2_faults, fault)["cancel_goal"] = ALWAYS
    result = under_way.nav.cancel(because="stop")
    assert under_way.graph.nav2.asked["cancel_goal"] == 2  # the goal, then all goals
    assert result.status == NavigationStatus.STILL_MOVING and USE_THE_REMOTE in result.reason


def test_a_cancel_lost_once_is_made_good_by_cancelling_all(under_way):
    under_way.graph.nav2_faults.cancel_code = None
    under_way.graph.nav2_faults.lost = Counter(cancel_goal=1)
    result = under_way.nav.cancel(because="stop")
    assert result.status == NavigationStatus.CANCELED
    assert not under_way.robot.moving


def test_a_cancel_slower_than_its_time_is_a_warning(under_way):
    under_way.graph.nav2_faults.slow_s = 1.5
    assert under_way.nav.cancel(because="stop").status == NavigationStatus.STILL_MOVING


def test_the_cancel_budget_of_the_port_is_one_second():
    limits = Nav2Limits()
    assert 2 * limits.cancel_s + CANCEL_PAUSE_S <= 1.0


def test_a_stop_is_heeded_while_nav2s_answer_to_the_goal_is_awaited(make_rig):
    said = []
    rig = make_rig(stop=lambda: said[0] if said else None)
    rig.start()
    rig.graph.nav2_faults.lost["send_goal"] = 1  # it drives, and its answer is lost
    said.append("the operator said stop")
    end = rig.nav.send(GOAL)
    assert end.status == NavigationStatus.CANCELED and "the operator said stop" in end.reason
    assert rig.graph.nav2.asked["send_goal"] == 1  # sent again it might have begun anew
    assert not rig.robot.moving and rig.nav.result() == end


def test_a_stop_from_another_thread_while_a_goal_is_being_sent_stops_it(rig, eventually):
    rig.graph.nav2_faults.slow_s = 0.2
    sent = []
    sender = threading.Thread(target=lambda: sent.append(rig.nav.send(GOAL)))
    sender.start()
    eventually(lambda: rig.nav.cancel(because="stop") != NEVER_SENT)
    sender.join()
    rig.clock.sleep(0.5)
    assert not rig.robot.moving
    assert sent[0] is not None or rig.nav.result() is not None


# Every goal, whatever is believed of ours


def test_a_halt_stops_a_goal_that_was_believed_to_have_ended(under_way):
    under_way.nav._goal.end = NavigationResult(NavigationStatus.SUCCEEDED, "so it seemed")
    assert under_way.nav.cancel(because="stop").status == NavigationStatus.SUCCEEDED
    assert under_way.robot.moving
    assert under_way.nav.halt(because="stop").status == NavigationStatus.CANCELED
    assert not under_way.robot.moving


def test_a_halt_stops_goals_of_others_and_is_taken_where_nothing_runs(rig):
    assert rig.nav.halt(because="stop").status == NavigationStatus.CANCELED
    rig.graph.nav2.drive(GOAL)
    rig.clock.sleep(1.0)
    assert rig.robot.moving
    assert rig.nav.halt(because="stop").status == NavigationStatus.CANCELED
    assert not rig.robot.moving


@pytest.mark.parametrize("fault", ["lost", "empty", "garbage"])
def test_a_halt_that_is_not_answered_warns_and_one_that_is_lost_once_is_made_good(under_way, fault):
    getattr(under_way.graph.nav2_faults, fault)["cancel_goal"] = ALWAYS
    result = under_way.nav.halt(because="stop")
    assert result.status == NavigationStatus.STILL_MOVING and USE_THE_REMOTE in result.reason
    getattr(under_way.graph.nav2_faults, fault)["cancel_goal"] = 1
    assert under_way.nav.halt(because="stop").status == NavigationStatus.CANCELED
    assert not under_way.robot.moving


@pytest.mark.parametrize("code", [0, 1])
def test_a_halt_that_is_refused_warns(under_way, code):
    under_way.graph.nav2_faults.cancel_code = code
    result = under_way.nav.halt(because="stop")
    assert result.status == NavigationStatus.STILL_MOVING and USE_THE_REMOTE in result.reason
