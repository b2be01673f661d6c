"""Our drivers against a real ROS 2: an rclpy ActionServer and a latched map on Fast-DDS, behind a stand-in bridge."""

from __future__ import annotations

import json
import struct
import subprocess
import time
import uuid

import numpy as np
import pytest

from drivers.clock import SystemClock
from drivers.nav2.bridge import Nav2Bridge
from drivers.nav2.limits import Nav2Limits
from drivers.ports import NavigationStatus, StaleData
from drivers.ros.action import (
    ABORTED,
    ALL_GOALS,
    CANCEL_OK,
    CANCEL_TERMINATED,
    CANCEL_UNKNOWN_GOAL,
    CANCELED,
    CANCELING,
    EXECUTING,
    SUCCEEDED,
    UNKNOWN,
    ActionClient,
    service_client,
)
from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.definitions import SERVICES, action_definitions
from drivers.ros.messages import codec, codec_with
from drivers.ros.shapes import Shapes, shapes_of
from drivers.ros.topics import RosMap
from drivers.topics import IS_ACTIVE, Action
from openbelief.pose import Pose2

FIBONACCI = Action("/fibonacci", "test_msgs/action/Fibonacci")
WAIT_S = 15.0  # for an answer, on a loaded machine
REFUSES_CANCEL, ABORTS = 1000, 2000  # added to the number of steps of 0.1 s; server.py


class Known:
    """A robot that knows where it is: there is no wheel with tf2_msgs."""

    def robot_pose(self, max_age_s):
        return Pose2(0.0, 0.0, 0.0)

    def transform_at(self, stamp_ns, frame_id):
        return np.eye(4)


class Talk:
    """An ActionClient on /fibonacci, and what it heard."""

    def __init__(self, link):
        steps = "int32[] sequence"
        texts = SERVICES | action_definitions(FIBONACCI.type_name, "int32 order", steps, steps)
        self.client = ActionClient(link, BridgeKeys(), FIBONACCI, Shapes((codec_with("kilted", texts),)))
        self.feedback, self.statuses = [], {}
        self.seen = set()  # (goal, status)
        self.client.listen(self.feedback.append, self._keep)

    def _keep(self, statuses):
        self.statuses = statuses
        self.seen |= set(statuses.items())

    def send(self, order, goal=None):
        """(uuid, whether it was accepted)."""
        goal = goal or uuid.uuid4().bytes
        return goal, self._message(self.client.send_goal(goal, WAIT_S, order=order)).accepted

    def result(self, goal):
        """(status, sequence) at the end of the goal."""
        response = self._message(self.client.get_result(goal, WAIT_S))
        return response.status, response.result.sequence.tolist()

    def cancel(self, goal):
        """(return code, the goals that are being cancelled)."""
        response = self._message(self.client.cancel(goal, WAIT_S))
        return response.return_code, {bytes(info.goal_id.uuid) for info in response.goals_canceling}

    def _message(self, answer):
        assert answer.message is not None, answer.why
        return answer.message


@pytest.fixture
def talk(link, eventually):
    made = Talk(link)
    is_active = service_client(link, BridgeKeys(), IS_ACTIVE, shapes_of())
    eventually(lambda: is_active.ask(1.0).message is not None)
    return made


@pytest.fixture
def nav(link, eventually):
    """The driver as it is, with short patience; a goal's x is the number of steps that the server takes."""
    return open_nav(link, eventually)


def open_nav(link, eventually):
    grid = RosMap(link)
    limits = Nav2Limits(result_wait_s=1.0, silence_s=3.0)
    made = Nav2Bridge(link, SystemClock(), Known(), grid, new_uuid=lambda: uuid.uuid4().bytes, limits=limits)
    grid.start()
    made.start()
    eventually(lambda: made.unavailable() is None)
    return made


def until_end(nav, within_s=20.0):
    deadline = time.monotonic() + within_s
    while (result := nav.result()) is None:
        assert time.monotonic() < deadline, "no result"
        time.sleep(0.05)
    return result


# The action protocol, byte for byte


def test_a_goal_is_accepted_reported_and_ended(talk, eventually):
    goal, accepted = talk.send(4)
    assert accepted
    assert talk.result(goal) == (SUCCEEDED, [0, 1, 2, 3])
    assert talk.result(goal) == (SUCCEEDED, [0, 1, 2, 3]), "asked again: the same"
    eventually(lambda: {(goal, EXECUTING), (goal, SUCCEEDED)} <= talk.seen)
    eventually(lambda: [0, 1, 2, 3] in [m.feedback.sequence.tolist() for m in talk.feedback])


def test_a_goal_is_rejected(talk):
    goal, accepted = talk.send(-1)
    assert not accepted
    assert talk.result(goal)[0] == UNKNOWN


def test_the_same_uuid_sent_twice_runs_once(talk):
    goal, accepted = talk.send(6)
    assert accepted
    assert talk.send(6, goal) == (goal, False)
    assert talk.result(goal) == (SUCCEEDED, [0, 1, 2, 3, 4, 5])


def test_a_goal_is_aborted(talk):
    goal, _ = talk.send(ABORTS + 2)
    assert talk.result(goal) == (ABORTED, [0, 1])


def test_one_goal_is_cancelled_and_another_goes_on(talk):
    (one, _), (other, _) = talk.send(100), talk.send(8)
    assert talk.cancel(one) == (CANCEL_OK, {one})
    assert talk.result(one)[0] == CANCELED
    assert talk.result(other)[0] == SUCCEEDED


def test_the_zero_uuid_cancels_all_goals(talk):
    goals = {talk.send(100)[0] for _ in range(3)}
    assert talk.cancel(ALL_GOALS) == (CANCEL_OK, goals)
    assert {talk.result(goal)[0] for goal in goals} == {CANCELED}


def test_a_cancel_may_be_refused(talk):
    goal, _ = talk.send(REFUSES_CANCEL + 20)
    assert talk.cancel(goal) == (CANCEL_OK, set()), "rclpy says ok and cancels nothing; rclcpp says 1"
    assert talk.result(goal)[0] == SUCCEEDED


def test_a_cancel_after_the_end_and_of_an_unknown_goal_say_so(talk):
    goal, _ = talk.send(1)
    assert talk.result(goal)[0] == SUCCEEDED
    assert talk.cancel(goal) == (CANCEL_TERMINATED, set())
    assert talk.cancel(uuid.uuid4().bytes) == (CANCEL_UNKNOWN_GOAL, set())


def test_the_result_of_an_unknown_goal_is_that_nobody_knows_it(talk):
    assert talk.result(uuid.uuid4().bytes)[0] == UNKNOWN


def test_every_one_of_many_questions_is_answered_and_what_a_round_trip_takes_is_told(talk, capsys):
    took_ms = []
    for _ in range(30):
        began = time.monotonic()
        assert talk.result(ALL_GOALS)[0] == UNKNOWN
        took_ms.append((time.monotonic() - began) * 1e3)
    with capsys.disabled():
        print(f"\nround trip to a real ROS 2 service: median {np.median(took_ms):.1f} ms, worst {max(took_ms):.1f} ms")


# The Navigator port as it is


def test_nav2_is_up_by_a_real_trigger_and_a_real_map(nav):
    assert nav.unavailable() is None


def test_a_drive_succeeds_with_feedback_and_tells_the_distribution(nav, eventually):
    assert nav.send(Pose2(5.0, 0.0, 0.0)) is None
    assert until_end(nav).status == NavigationStatus.SUCCEEDED
    eventually(lambda: nav.feedback() is not None)
    feedback = nav.feedback()
    assert 0.0 <= feedback.pose.x <= 4.0 and feedback.distance_remaining_m == 1.25
    assert nav.distributions == ("jazzy",), "Kilted is Jazzy on the wire"


def test_a_drive_is_rejected(nav):
    assert nav.send(Pose2(-1.0, 0.0, 0.0)).status == NavigationStatus.REJECTED


def test_a_drive_is_aborted_with_its_code(nav):
    nav.send(Pose2(ABORTS + 2.0, 0.0, 0.0))
    result = until_end(nav)
    assert (result.status, result.code) == (NavigationStatus.ABORTED, 208)


def test_a_drive_is_cancelled(nav):
    nav.send(Pose2(100.0, 0.0, 0.0))
    assert nav.cancel(because="the operator said stop").status == NavigationStatus.CANCELED


def test_a_drive_whose_cancel_is_refused_is_a_warning(nav, talk, eventually):
    nav.send(Pose2(REFUSES_CANCEL + 30.0, 0.0, 0.0))
    assert nav.cancel(because="the operator said stop").status == NavigationStatus.STILL_MOVING
    eventually(lambda: not {EXECUTING, CANCELING} & set(talk.statuses.values()))


def test_a_drive_cancelled_by_somebody_else_is_named(nav, talk):
    nav.send(Pose2(100.0, 0.0, 0.0))
    assert talk.cancel(ALL_GOALS)[0] == CANCEL_OK
    result = until_end(nav)
    assert (result.status, "not by this program" in result.reason) == (NavigationStatus.CANCELED, True)


# The latched map


def expected_cells():
    cells = np.zeros((4, 5), np.int8)
    cells[1, 2], cells[2, 2] = 100, -1
    return cells


def has_map(grid):
    try:
        return grid.latest() is not None
    except StaleData:
        return False


def assert_map_arrives(link, eventually):
    grid = RosMap(link)
    grid.start()
    eventually(lambda: has_map(grid))
    arrived = grid.latest()
    assert np.array_equal(arrived.cells, expected_cells())
    assert (arrived.resolution_m, *arrived.origin_xy) == (0.5, -1.0, -2.0)


def test_who_joins_late_still_gets_the_map(peer, talk, eventually):
    with peer.link() as late:
        assert_map_arrives(late, eventually)


# Processes that die


def test_a_server_killed_in_the_middle_is_a_warning_and_its_goal_is_gone(peer, link, eventually):
    nav, talk = open_nav(link, eventually), Talk(link)
    nav.send(Pose2(100.0, 0.0, 0.0))
    goal, _ = talk.send(100)
    eventually(lambda: nav.feedback() is not None)
    peer.kill("server")
    result = until_end(nav)
    assert result.status == NavigationStatus.STILL_MOVING and "use the remote" in result.reason

    peer.start("server")
    eventually(lambda: nav.unavailable() is None)
    eventually(lambda: talk.client.get_result(goal, 1.0).message is not None)
    assert talk.result(goal)[0] == UNKNOWN, "a restarted server knows no goal"
    nav.send(Pose2(3.0, 0.0, 0.0))
    assert until_end(nav).status == NavigationStatus.SUCCEEDED


def test_a_bridge_that_joins_late_brings_the_map_and_the_goals_end(peer, link, eventually):
    nav = open_nav(link, eventually)
    peer.kill("bridge")
    eventually(lambda: "bridge" in (nav.unavailable() or ""))
    peer.start("bridge")
    eventually(lambda: nav.unavailable() is None)
    nav.send(Pose2(3.0, 0.0, 0.0))
    assert until_end(nav).status == NavigationStatus.SUCCEEDED
    with peer.link() as late:
        assert_map_arrives(late, eventually)


# Bytes


@pytest.fixture(scope="module")
def written(ros_python):
    """What rclpy writes, by name."""
    here = ros_python.parents[2] / "tests" / "ros_peer" / "written.py"
    done = subprocess.run([str(ros_python), str(here)], capture_output=True, text=True, timeout=60, check=True)
    return {name: bytes.fromhex(text) for name, text in json.loads(done.stdout).items()}


def test_a_path_question_with_the_poses_that_rclpy_wrote_is_one_of_ours(written):
    """No wheel has ComputePathToPose; GetPlan has its two poses in a row, which end at a multiple of 8 bytes."""
    kind = "nav2_msgs/action/ComputePathToPose_SendGoal_Request"
    poses = written["two poses in a row"][4 : 4 + 144]
    rest = struct.pack("<I10s?", 10, b"GridBased\0", False)
    payload = b"\x00\x01\x00\x00" + bytes(range(16)) + poses + rest
    read = codec().decode(payload, kind)
    assert (read.goal.goal.header.frame_id, read.goal.goal.pose.position.x) == ("map", 1.0)
    assert (read.goal.start.header.frame_id, read.goal.start.pose.orientation.w) == ("", 1.0)
    assert (read.goal.planner_id, read.goal.use_start) == ("GridBased", False)
    assert len(codec().encode(read)) == len(payload) == 4 + 175


def test_ros_fills_the_end_of_an_empty_request_and_we_read_it(written):
    codec().decode(written["empty request"], "std_srvs/srv/Trigger_Request")
    assert len(written["empty request"]) == 8
