"""The other failure modes of docs/nav2.md, on real sessions: each ends in a named result, and none hangs."""

from __future__ import annotations

import pytest

from drivers.nav2.bridge import Nav2Bridge
from drivers.nav2.limits import Nav2Limits
from drivers.nav2.result import SAID
from drivers.ports import LinkLost, NavigationStatus, PoseUnavailable, StaleData
from drivers.ros.action import ABORTED, CANCELED, SUCCEEDED
from drivers.ros.messages import codec
from drivers.topics import LIDAR, NAVIGATE_TO_POSE, TF, TF_STATIC
from openbelief.pose import Pose2
from sim_fakes.wire.faults import ALWAYS, Nav2Faults, SensorFaults, oversize
from sim_fakes.wire.nav2_messages import Nav2Messages, ServedGoal

GOAL = Pose2(3.5, 3.0, 1.0)
USE_THE_REMOTE = "use the remote"


# 3: an empty reply list


def test_an_empty_reply_is_no_statement_on_the_path(rig):
    rig.graph.nav2_faults.empty["plan"] = ALWAYS
    with pytest.raises(LinkLost, match="nobody answered"):
        rig.nav.plan(GOAL)


@pytest.mark.parametrize("fault", ["lost", "empty", "garbage"])
def test_a_plan_whose_answer_was_lost_once_is_asked_for_again(rig, fault):
    getattr(rig.graph.nav2_faults, fault)["plan"] = 1
    assert rig.nav.plan(GOAL).length_m > 1.0


@pytest.mark.parametrize("fault", ["lost", "empty", "garbage"])
def test_a_success_whose_result_never_arrives_is_not_believed(rig, fault):
    getattr(rig.graph.nav2_faults, fault)["get_result"] = ALWAYS
    rig.nav.send(GOAL)
    result = rig.until_end()
    assert result.status == NavigationStatus.LOST
    assert "result message was lost" in result.reason


def test_an_abort_whose_result_never_arrives_is_concluded_from_status_and_cancel(rig):
    rig.graph.nav2_faults.lost["get_result"] = ALWAYS
    rig.nav.send(GOAL)
    rig.graph.nav2_faults.abort = (105, "no progress")
    result = rig.until_end()
    assert result.status == NavigationStatus.ABORTED and "result message was lost" in result.reason


@pytest.mark.parametrize("status", [SUCCEEDED, CANCELED, ABORTED])
def test_a_status_on_the_wire_ends_no_goal_that_drives(under_way, status):
    """Anybody can put a status; the server that still drives is asked, and the goal cancelled there."""
    rig, uuid = under_way, under_way.nav._goal.uuid
    accepted_ns = rig.graph.nav2._goals[uuid].stamp_ns
    forged = Nav2Messages(codec()).statuses([ServedGoal(uuid, None, accepted_ns, status=status)])
    rig.graph.bridge.put(rig.graph.bridge.keys.action(NAVIGATE_TO_POSE, "status"), codec().encode(forged), latched=True)
    rig.graph.bridge.flush()
    result = rig.until_end()
    assert result.status == NavigationStatus.LOST
    assert f"status says {SAID[status]}" in result.reason and "under way all the same" in result.reason
    assert not rig.robot.moving


# 4: a goal whose acceptance is unknown


@pytest.mark.parametrize("fault", ["lost", "empty", "garbage"])
def test_a_goal_whose_acceptance_was_lost_runs_once(rig, fault):
    getattr(rig.graph.nav2_faults, fault)["send_goal"] = 1
    assert rig.nav.send(GOAL) is None
    assert rig.until_end().status == NavigationStatus.SUCCEEDED
    assert rig.graph.nav2.accepted == 1


def test_a_rejection_that_was_lost_is_still_a_rejection(rig):
    rig.graph.nav2_faults.reject = True
    rig.graph.nav2_faults.lost["send_goal"] = 1
    assert rig.nav.send(GOAL).status == NavigationStatus.REJECTED


@pytest.mark.parametrize("fault", ["lost", "empty", "garbage"])
def test_a_goal_that_is_never_acknowledged_is_cancelled(rig, fault):
    getattr(rig.graph.nav2_faults, fault)["send_goal"] = ALWAYS
    result = rig.nav.send(GOAL)
    assert result.status == NavigationStatus.LOST
    assert "did not say whether it took the goal" in result.reason and "cancelled" in result.reason
    assert not rig.robot.moving
    assert rig.nav.result() == result


def test_a_rejected_goal_is_named(rig):
    rig.graph.nav2_faults.reject = True
    assert rig.nav.send(GOAL).status == NavigationStatus.REJECTED
    assert not rig.robot.moving


def test_a_slow_nav2_is_waited_for(rig):
    rig.graph.nav2_faults.slow_s = 0.1
    assert rig.nav.send(GOAL) is None
    assert rig.until_end().status == NavigationStatus.SUCCEEDED


# 5: long goals


def test_a_long_goal_outlives_many_expired_result_questions(make_rig, eventually):
    rig = make_rig(limits=Nav2Limits(result_wait_s=0.05))
    rig.start()
    rig.nav.send(GOAL)
    eventually(lambda: rig.nav.result() is None and rig.graph.nav2.asked["get_result"] > 3)  # each expired before
    assert rig.until_end().status == NavigationStatus.SUCCEEDED


def test_one_question_for_the_result_waits_at_the_server_however_long_the_drive(make_rig):
    """The bridge forwards each, and the server keeps all of them until the goal ends."""
    rig = make_rig(limits=Nav2Limits(), nav2_faults=Nav2Faults(stuck=True))
    rig.start()
    rig.nav.send(GOAL)
    for _ in range(1200):  # two minutes, asked ten times a second
        assert rig.nav.result() is None
        rig.clock.sleep(0.1)
    assert rig.graph.nav2.asked["get_result"] == 1
    rig.graph.nav2_faults.abort = (208, "no valid path")
    assert rig.until_end().status == NavigationStatus.ABORTED
    assert rig.graph.nav2.asked["get_result"] == 1


def test_a_goal_that_falls_silent_is_cancelled_and_lost(under_way):
    under_way.graph.nav2_faults.silent = under_way.graph.nav2_faults.stuck = True
    result = under_way.until_end(within_s=10.0)
    assert result.status == NavigationStatus.LOST
    assert "silent" in result.reason and not under_way.robot.moving


def test_a_goal_that_never_ends_is_timed_out_and_cancelled(make_rig):
    rig = make_rig(limits=Nav2Limits(goal_s=20.0), nav2_faults=Nav2Faults(stuck=True))
    rig.start()
    rig.nav.send(GOAL)
    result = rig.until_end(within_s=30.0)
    assert result.status == NavigationStatus.TIMED_OUT
    assert "20 s" in result.reason


# 8: ends that are not what they seem


def test_a_preempted_goal_is_named(under_way):
    under_way.graph.nav2.preempt()
    result = under_way.until_end()
    assert result.status == NavigationStatus.PREEMPTED
    assert "somebody else" in result.reason


def test_an_abort_without_a_code_is_not_called_preempted(under_way):
    under_way.graph.nav2_faults.abort = (0, "")
    result = under_way.until_end()
    assert (result.status, result.code) == (NavigationStatus.ABORTED, 0)


@pytest.mark.parametrize(("code", "words"), [(105, "no progress"), (9003, "too long"), (4711, "error 4711")])
def test_an_abort_carries_its_code_and_words(under_way, code, words):
    under_way.graph.nav2_faults.abort = (code, "as the server put it")
    result = under_way.until_end()
    assert (result.status, result.code) == (NavigationStatus.ABORTED, code)
    assert words in result.reason and "as the server put it" in result.reason


def test_a_goal_that_nav2_forgot_is_lost(under_way):
    under_way.graph.nav2.restart()
    result = under_way.until_end()
    assert result.status == NavigationStatus.LOST
    assert "restarted" in result.reason


def test_a_goal_cancelled_by_somebody_else_is_named(under_way):
    from drivers.ros.action import ALL_GOALS

    under_way.nav._navigate.cancel(ALL_GOALS, 1.0)  # as another client would
    result = under_way.until_end()
    assert result.status == NavigationStatus.CANCELED and "not by this program" in result.reason


# 9: Fast-DDS


def test_topics_without_actions_point_to_the_middleware(make_rig):
    rig = make_rig()
    rig.start()
    rig.graph.bridge.withdraw(NAVIGATE_TO_POSE)
    rig.clock.sleep(0.2)
    sentence = rig.nav.unavailable()
    assert "rmw_cyclonedds_cpp" in sentence and "Fast-DDS" in sentence


def test_an_inactive_nav2_is_unavailable(rig):
    rig.graph.nav2_faults.inactive = True
    assert "not active" in rig.nav.unavailable()


@pytest.mark.parametrize("fault", ["lost", "empty", "garbage"])
def test_a_lifecycle_manager_that_does_not_answer_is_unavailable(rig, fault):
    getattr(rig.graph.nav2_faults, fault)["is_active"] = ALWAYS
    assert "does not say whether Nav2 is active" in rig.nav.unavailable()


# 10: transforms


def test_a_missing_tf_static_is_a_refusal_not_a_guess(make_rig):
    rig = make_rig(sensor_faults=SensorFaults(muted={TF_STATIC.name}))
    rig.start()
    with pytest.raises(PoseUnavailable, match="No transforms join"):
        rig.poses.transform_at(rig.clock.now_ns(), "camera_color_optical_frame")


def test_a_pose_that_grows_old_makes_nav2_unavailable(rig):
    rig.graph.sensor_faults.muted.add(TF.name)
    rig.clock.sleep(1.0)
    assert "does not know where it is" in rig.nav.unavailable()


# 11: large topics


def test_an_oversize_message_is_dropped_and_counted(rig):
    rig.graph.sensor_faults.spoiled[LIDAR.name] = oversize
    rig.clock.sleep(2.0)
    with pytest.raises(StaleData, match=r"dropped.*more than"):
        rig.lidar.latest(1.0)


# 12: clock skew


def test_a_stamp_from_the_future_names_the_clocks(rig):
    rig.graph.sensor_faults.frozen_ns = rig.clock.now_ns() + 3_600_000_000_000
    rig.clock.sleep(1.0)
    with pytest.raises(StaleData, match="synchronise the clocks"):
        rig.lidar.latest(1.0)


# 13: what vanishes silently


def test_a_command_that_nobody_acknowledges_did_not_happen(make_rig):
    rig = make_rig()  # nothing serves the actions: as behind an access rule
    result = rig.nav.send(GOAL)
    assert result.status == NavigationStatus.STILL_MOVING
    assert "nobody answered" in result.reason and USE_THE_REMOTE in result.reason


# Bad bytes on the topics


def test_garbage_feedback_and_status_are_ignored(under_way):
    keys = under_way.graph.bridge.keys
    for part in ("feedback", "status"):
        under_way.graph.bridge.put(keys.action(NAVIGATE_TO_POSE, part), b"\xff\xff nonsense", latched=part == "status")
    assert under_way.until_end().status == NavigationStatus.SUCCEEDED


def test_a_result_asked_before_any_goal_is_refused(rig):
    from drivers.ports import PortError

    with pytest.raises(PortError, match="No goal was sent"):
        rig.nav.result()


def test_the_bridge_is_a_navigator(rig):
    from drivers.ports import Navigator

    assert isinstance(rig.nav, Navigator) and isinstance(rig.nav, Nav2Bridge)
