"""Every failure mode of docs/nav2.md, on real sessions: each ends in a named result, and none hangs."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections import Counter
from types import SimpleNamespace

import pytest

from drivers.nav2.bridge import Nav2Bridge
from drivers.nav2.cancelling import CANCEL_PAUSE_S
from drivers.nav2.limits import Nav2Limits
from drivers.nav2.result import SAID
from drivers.ports import LinkLost, NavigationResult, NavigationStatus, PoseUnavailable, StaleData
from drivers.ros.action import ABORTED, CANCELED, EXECUTING, SUCCEEDED
from drivers.ros.messages import codec
from drivers.ros.zenoh_link import LinkConfig, ZenohLink, open_router
from drivers.topics import LIDAR, NAVIGATE_TO_POSE, TF, TF_STATIC
from openbelief.pose import Pose2
from sim_fakes.wire.faults import ALWAYS, Nav2Faults, SensorFaults, oversize
from sim_fakes.wire.nav2_messages import Nav2Messages, ServedGoal
from sim_fakes.wire.nav2_server import SimNav2Server
from sim_fakes.wire.sim_bridge import SimBridge
from sim_fakes.world.robot import SimRobot

GOAL = Pose2(3.5, 3.0, 1.0)
USE_THE_REMOTE = "use the remote"
NEVER_SENT = NavigationResult(NavigationStatus.CANCELED, "No goal was under way.")


@pytest.fixture
def under_way(rig):
    """A robot that has been driving for a second."""
    rig.nav.send(GOAL)
    rig.clock.sleep(1.0)
    assert rig.robot.moving
    return rig


# 1, 2: links


def test_a_killed_bridge_is_named_and_the_operator_warned(under_way):
    under_way.graph.bridge.close()
    result = under_way.until_end(within_s=10.0)
    assert result.status == NavigationStatus.STILL_MOVING
    assert "bridge" in result.reason and USE_THE_REMOTE in result.reason


def test_a_query_to_a_killed_bridge_ends_at_once(under_way, eventually):
    under_way.graph.bridge.close()
    with pytest.raises(LinkLost, match="planner does not answer: nobody answered"):  # not "in time": it did not wait
        under_way.nav.plan(GOAL)
    eventually(lambda: "zenoh-bridge-ros2dds" in (under_way.nav.unavailable() or ""))


def test_a_silent_link_is_noticed_within_the_bridges_lease(silent_wire, eventually):
    with open_router(lease_s=0.5) as endpoint:
        wire = silent_wire(endpoint)
        with ZenohLink(LinkConfig((wire.endpoint,))) as link:
            assert link.alive
            wire.cut()
            eventually(lambda: not link.alive)
            wire.refuse()


def test_a_silent_link_never_hangs_a_plan_or_a_cancel(make_rig, silent_wire):
    wires = []

    def through(endpoint):
        wires.append(silent_wire(endpoint))
        return wires[0].endpoint

    rig = make_rig(through=through)
    rig.start()
    rig.nav.send(GOAL)
    wires[0].cut()
    with pytest.raises(LinkLost):
        rig.nav.plan(GOAL)
    assert rig.nav.cancel(because="the operator said stop").status == NavigationStatus.STILL_MOVING
    wires[0].refuse()


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


# 12: two servers of one action


@pytest.fixture
def second(rig):
    """Another Nav2 with a robot of its own, behind another bridge; `start()` brings it up."""
    with SimBridge(rig.link.config.endpoints[0]) as bridge:
        robot = SimRobot(rig.room, rig.clock, Pose2(1.0, 1.0, 0.0))
        server = SimNav2Server(bridge, rig.clock, robot, rig.room.occupancy_grid())
        yield SimpleNamespace(bridge=bridge, robot=robot, server=server, start=server.start)


def test_two_servers_are_refused_before_a_drive(rig, second, eventually):
    second.start()
    eventually(lambda: "2 Nav2 servers" in (rig.nav.unavailable() or ""))
    with pytest.raises(LinkLost, match="2 servers answered"):
        rig.nav.plan(GOAL)


def test_a_goal_that_two_servers_took_is_cancelled_at_both(rig, second, eventually):
    second.start()
    eventually(lambda: rig.nav.readiness.doubled)
    result = rig.nav.send(GOAL)
    assert result.status == NavigationStatus.LOST and "2 Nav2 servers" in result.reason
    rig.clock.sleep(0.5)
    assert rig.graph.nav2.accepted == second.server.accepted == 1
    assert not rig.robot.moving and not second.robot.moving


def test_a_second_server_that_comes_under_way_ends_the_drive(under_way, second, eventually):
    second.start()
    eventually(lambda: under_way.nav.result() is not None)
    assert under_way.nav.result().status == NavigationStatus.LOST and "2 Nav2 servers" in under_way.nav.result().reason
    assert not under_way.robot.moving


def test_two_servers_behind_one_bridge_are_told_by_the_two_moments_of_their_acceptance(under_way):
    rig, uuid = under_way, under_way.nav._goal.uuid
    other = Nav2Messages(codec()).statuses([ServedGoal(uuid, None, 12_000_000_034, status=EXECUTING)])
    rig.graph.bridge.put(rig.graph.bridge.keys.action(NAVIGATE_TO_POSE, "status"), codec().encode(other), latched=True)
    rig.graph.bridge.flush()
    result = rig.until_end()
    assert result.status == NavigationStatus.LOST and "2 Nav2 servers" in result.reason
    assert not rig.robot.moving


def test_a_server_that_refuses_the_cancel_is_not_outvoted_by_one_that_takes_it(rig, second, eventually):
    second.start()
    eventually(lambda: rig.nav.readiness.doubled)
    second.server.faults.cancel_code = 1
    assert rig.nav.halt(because="stop").status == NavigationStatus.STILL_MOVING


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


# 6: no deadman in Zenoh


def test_the_robot_drives_on_when_the_workstation_dies(under_way):
    """Not a promise but a warning: the watchdog on the robot (openbelief onboard) is what stops it."""
    under_way.link.close()
    under_way.clock.sleep(1.0)
    assert under_way.robot.moving
    result = under_way.nav.cancel(because="the link is closed")
    assert result.status == NavigationStatus.STILL_MOVING and USE_THE_REMOTE in result.reason


# 7: reconnection


def test_after_a_reconnection_the_goals_end_is_still_learned(make_rig, silent_wire, eventually):
    wires = []

    def through(endpoint):
        wires.append(silent_wire(endpoint))
        return wires[0].endpoint

    rig = make_rig(through=through, limits=Nav2Limits(silence_s=60.0))
    rig.start()
    rig.nav.send(GOAL)
    wires[0].refuse()
    eventually(lambda: not rig.link.alive)
    rig.clock.sleep(30.0)  # the robot arrives unwatched
    assert rig.nav.result() is None
    wires[0].mend()
    eventually(lambda: rig.nav.result() is not None)
    assert rig.nav.result().status == NavigationStatus.SUCCEEDED


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


# 14: processes and ports


def test_a_process_with_an_open_link_ends_on_sigterm():
    code = (
        "import sys, threading\n"
        "from drivers.ros.zenoh_link import LinkConfig, ZenohLink, open_router\n"
        "with open_router() as endpoint, ZenohLink(LinkConfig((endpoint,))) as link:\n"
        "    link.subscribe('tf', print)\n"
        "    print('open', flush=True)\n"
        "    threading.Event().wait()\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline().strip() == "open"
        process.terminate()
        process.wait(timeout=5.0)


def test_two_routers_get_two_ports():
    with open_router() as one, open_router() as other:
        assert one != other


# Cancelling


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


def test_a_slow_nav2_is_waited_for(rig):
    rig.graph.nav2_faults.slow_s = 0.1
    assert rig.nav.send(GOAL) is None
    assert rig.until_end().status == NavigationStatus.SUCCEEDED


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
