"""Nav2 behind the bridge, simulated: NavigateToPose, ComputePathToPose and is_active, driving a SimRobot on its map."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from drivers import ros_action as action
from drivers.ros_convert import path_message, pose_message, pose_of
from drivers.ros_messages import Message, WireError, codec, ns_to_stamp
from drivers.topics import COMPUTE_PATH_TO_POSE, IS_ACTIVE, NAVIGATE_TO_POSE
from openbelief.arrays import Array
from openbelief.g1 import BODY_RADIUS_M
from openbelief.pose import Pose2
from openbelief.traversability import NoPath, OccupancyGrid, path, path_length
from sim_fakes.faults import GARBAGE, Nav2Faults
from sim_fakes.sim_bridge import Question, SimBridge
from sim_fakes.sim_clock import SimClock

TICK_S = 0.1
FEEDBACK_TICKS = 5  # feedback twice a second
MARGINS_M = (0.15, 0.08, 0.03)  # beyond the body, the widest first: a robot that walks cuts corners
NO_PROGRESS, GOAL_OUTSIDE, GOAL_OCCUPIED, NO_PATH = 105, 204, 206, 208


class Walker(Protocol):
    """What Nav2 needs of the robot."""

    @property
    def believed_pose(self) -> Pose2: ...

    @property
    def moving(self) -> bool: ...

    def follow(self, path_xy: Array, final_yaw: float) -> None: ...

    def halt(self) -> None: ...


class PlanFailed(Exception):
    """No path; args: Nav2's error code and message."""


@dataclass
class ServedGoal:
    uuid: bytes
    pose: Pose2 | None  # None: a pose that Nav2 cannot use
    stamp_ns: int
    status: int = action.EXECUTING
    error: tuple[int, str] = (0, "")
    waiting: list[Question] = field(default_factory=list)


class SimNav2Server:
    """The action servers. Planning takes no simulated time; driving takes as long as the robot needs.

    Questions are answered on Zenoh's threads, progress is made by the clock.
    """

    def __init__(
        self,
        bridge: SimBridge,
        clock: SimClock,
        robot: Walker,
        grid: OccupancyGrid,
        faults: Nav2Faults | None = None,
        *,
        distribution: str = "jazzy",
    ) -> None:
        self._bridge, self._clock, self._robot = bridge, clock, robot
        self.faults = faults or Nav2Faults()
        self._grids = [grid.inflated(BODY_RADIUS_M + margin) for margin in MARGINS_M]
        self._codec = codec(distribution)
        self._goals: dict[bytes, ServedGoal] = {}
        self._plans: dict[bytes, Message] = {}
        self._kept: list[Question] = []  # lost on purpose: a query ends when nobody holds it
        self._lock = threading.RLock()
        self._ticks = 0
        self.accepted = 0

    def start(self) -> None:
        """Declare everything and begin to drive."""
        self._serve(NAVIGATE_TO_POSE.name, "send_goal", self._send_goal)
        self._serve(NAVIGATE_TO_POSE.name, "get_result", self._get_result)
        self._serve(NAVIGATE_TO_POSE.name, "cancel_goal", self._cancel_goal)
        self._serve(COMPUTE_PATH_TO_POSE.name, "send_goal", self._send_plan)
        self._serve(COMPUTE_PATH_TO_POSE.name, "get_result", self._get_plan)
        self._bridge.answer(self._bridge.keys.service(IS_ACTIVE), lambda q: self._reply("is_active", q, self._active()))
        self._bridge.offer(NAVIGATE_TO_POSE)
        self._bridge.offer(COMPUTE_PATH_TO_POSE)
        self._publish_status()
        self._clock.every(TICK_S, self._tick)

    # What a drill can do

    def preempt(self, uuid: bytes = bytes(15) + b"\x01") -> None:
        """Another client sends a goal to where the robot stands."""
        with self._lock:
            self._accept(ServedGoal(uuid, self._robot.believed_pose, self._clock.now_ns()))

    def restart(self) -> None:
        """Nav2's process dies and comes back: the robot stops and no goal is known any more."""
        with self._lock:
            self._robot.halt()
            for goal in self._goals.values():
                self._release(goal)
            self._goals.clear()
            self._publish_status()

    # Questions

    def _serve(self, name: str, part: str, handler: Callable[[Question], None]) -> None:
        key = f"{self._bridge.keys.name(name)}/_action/{part}"

        def serve(question: Question) -> None:
            try:
                handler(question)
            except WireError:
                question.drop()  # the bridge logs a request it cannot read, and answers nothing

        self._bridge.answer(key, serve)

    def _send_goal(self, question: Question) -> None:
        request = self._decode(question, f"{NAVIGATE_TO_POSE.type_name}_SendGoal_Request")
        uuid = bytes(request.goal_id.uuid)
        with self._lock:
            accepted = uuid not in self._goals and not self.faults.reject
            if accepted:
                self._accept(ServedGoal(uuid, _usable(request.goal.pose), self._clock.now_ns()))
        self._reply("send_goal", question, self._accepted(NAVIGATE_TO_POSE.type_name, accepted))

    def _get_result(self, question: Question) -> None:
        request = self._decode(question, f"{NAVIGATE_TO_POSE.type_name}_GetResult_Request")
        with self._lock:
            goal = self._goals.get(bytes(request.goal_id.uuid))
            if goal is not None and goal.status in action.ACTIVE:
                goal.waiting.append(question)
                return
        self._reply("get_result", question, self._result(goal))

    def _cancel_goal(self, question: Question) -> None:
        request = self._decode(question, f"{action.CANCEL}_Request")
        uuid = bytes(request.goal_info.goal_id.uuid)
        with self._lock:
            code, canceling = self._cancelled(uuid)
            for goal in canceling:
                self._end(goal, action.CANCELED)
        infos = [self._goal_info(goal) for goal in canceling]
        response = self._make(f"{action.CANCEL}_Response", return_code=code, goals_canceling=infos)
        self._reply("cancel_goal", question, response)

    def _cancelled(self, uuid: bytes) -> tuple[int, list[ServedGoal]]:
        active = [g for g in self._goals.values() if g.status in action.ACTIVE]
        if self.faults.cancel_code is not None:
            return self.faults.cancel_code, []
        if uuid == action.ALL_GOALS:
            return action.CANCEL_OK, active
        if uuid not in self._goals:
            return action.CANCEL_UNKNOWN_GOAL, []
        chosen = [g for g in active if g.uuid == uuid]
        return (action.CANCEL_OK, chosen) if chosen else (action.CANCEL_TERMINATED, [])

    def _send_plan(self, question: Question) -> None:
        request = self._decode(question, f"{COMPUTE_PATH_TO_POSE.type_name}_SendGoal_Request")
        uuid = bytes(request.goal_id.uuid)
        with self._lock:
            accepted = uuid not in self._plans and not self.faults.reject
            if accepted:
                self._plans[uuid] = self._planned(_usable(request.goal.goal))
        self._reply("plan", question, self._accepted(COMPUTE_PATH_TO_POSE.type_name, accepted))

    def _get_plan(self, question: Question) -> None:
        name = f"{COMPUTE_PATH_TO_POSE.type_name}_GetResult"
        request = self._decode(question, f"{name}_Request")
        unknown = self._make(f"{name}_Response", status=action.UNKNOWN)
        self._reply("plan", question, self._plans.get(bytes(request.goal_id.uuid), unknown))

    def _planned(self, pose: Pose2 | None) -> Message:
        kind = COMPUTE_PATH_TO_POSE.type_name
        try:
            points = self._path(pose)
        except PlanFailed as failed:
            result = self._failed(f"{kind}_Result", *failed.args)
            return self._make(f"{kind}_GetResult_Response", status=action.ABORTED, result=result)
        result = self._make(f"{kind}_Result", path=path_message(points, self._clock.now_ns()))
        return self._make(f"{kind}_GetResult_Response", status=action.SUCCEEDED, result=result)

    def _active(self) -> Message:
        return self._make(f"{IS_ACTIVE.type_name}_Response", success=not self.faults.inactive)

    # Driving

    def _accept(self, goal: ServedGoal) -> None:
        """A new goal replaces the one under way, which ends as aborted with code 0."""
        for other in self._goals.values():
            if other.status in action.ACTIVE:
                self._end(other, action.ABORTED)
        self._goals[goal.uuid] = goal
        self.accepted += 1
        self._publish_status()
        if goal.pose is not None and not self.faults.stuck:
            try:
                self._robot.follow(self._path(goal.pose)[1:], goal.pose.yaw)
            except PlanFailed as failed:
                goal.error = failed.args

    def _path(self, pose: Pose2 | None) -> Array:
        """(n, 2) points from the robot to the pose; raises PlanFailed."""
        if pose is None:
            raise PlanFailed(0, "")
        grid = self._grids[-1]
        if not grid.contains(grid.cell(pose.xy)):
            raise PlanFailed(GOAL_OUTSIDE, "goal outside the map")
        if not grid.free[tuple(grid.cell(pose.xy))]:
            raise PlanFailed(GOAL_OCCUPIED, "goal occupied")
        for inflated in self._grids:
            try:
                return path(inflated, self._robot.believed_pose.xy, pose.xy)
            except NoPath as error:
                reason = str(error)
        raise PlanFailed(NO_PATH, reason)

    def _tick(self) -> None:
        with self._lock:
            self._ticks += 1
            for goal in [g for g in self._goals.values() if g.status in action.ACTIVE]:
                self._progress(goal)
        self._bridge.flush()

    def _progress(self, goal: ServedGoal) -> None:
        if self.faults.abort is not None:
            goal.error, self.faults.abort = self.faults.abort, None
            self._end(goal, action.ABORTED)
        elif goal.pose is None or goal.error[0]:
            self._end(goal, action.ABORTED)
        elif not self._robot.moving and not self.faults.stuck:
            arrived = self._robot.believed_pose.distance_to(goal.pose) < 0.25
            goal.error = (0, "") if arrived else (NO_PROGRESS, "no progress")
            self._end(goal, action.SUCCEEDED if arrived else action.ABORTED)
        elif self._ticks % FEEDBACK_TICKS == 0 and not self.faults.silent:
            self._publish_feedback(goal)

    def _end(self, goal: ServedGoal, status: int) -> None:
        self._robot.halt()
        goal.status = status
        self._publish_status()
        self._release(goal)

    def _release(self, goal: ServedGoal) -> None:
        for question in goal.waiting:
            self._reply("get_result", question, self._result(goal))
        goal.waiting.clear()

    # Messages

    def _reply(self, part: str, question: Question, message: Message) -> None:
        if self.faults.slow_s:
            time.sleep(self.faults.slow_s)
        if self.faults.take(self.faults.lost, part):
            self._kept.append(question)
        elif self.faults.take(self.faults.empty, part):
            question.drop()
        elif self.faults.take(self.faults.garbage, part):
            question.answer(GARBAGE)
        elif self._bridge.open:
            question.answer(self._codec.encode(message))

    def _publish_status(self) -> None:
        if self.faults.silent:
            return
        states = [
            self._make("action_msgs/msg/GoalStatus", goal_info=self._goal_info(g), status=g.status)
            for g in self._goals.values()
        ]
        array = self._make(action.STATUS_ARRAY, status_list=states)
        key = self._bridge.keys.action(NAVIGATE_TO_POSE, "status")
        self._bridge.put(key, self._codec.encode(array), latched=True)

    def _publish_feedback(self, goal: ServedGoal) -> None:
        kind, now_ns = NAVIGATE_TO_POSE.type_name, self._clock.now_ns()
        seconds, nanoseconds = divmod(now_ns - goal.stamp_ns, 1_000_000_000)
        feedback = self._make(
            f"{kind}_Feedback",
            current_pose=pose_message(self._robot.believed_pose, now_ns),
            navigation_time=self._make("builtin_interfaces/msg/Duration", sec=seconds, nanosec=nanoseconds),
            distance_remaining=self._remaining(goal),
        )
        message = self._make(f"{kind}_FeedbackMessage", goal_id=self._uuid(goal.uuid), feedback=feedback)
        self._bridge.put(self._bridge.keys.action(NAVIGATE_TO_POSE, "feedback"), self._codec.encode(message))

    def _remaining(self, goal: ServedGoal) -> float:
        try:
            return path_length(self._path(goal.pose))
        except PlanFailed:
            return 0.0

    def _result(self, goal: ServedGoal | None) -> Message:
        kind = NAVIGATE_TO_POSE.type_name
        if goal is None:
            return self._make(f"{kind}_GetResult_Response", status=action.UNKNOWN)
        result = self._failed(f"{kind}_Result", *goal.error)
        return self._make(f"{kind}_GetResult_Response", status=goal.status, result=result)

    def _failed(self, type_name: str, code: int, message: str) -> Message:
        """A result with an error, where this distribution's results can say one."""
        result = self._make(type_name)
        if hasattr(result, "error_code"):
            result.error_code, result.error_msg = code, message
        return result

    def _accepted(self, type_name: str, accepted: bool) -> Message:
        stamp = ns_to_stamp(self._clock.now_ns())
        return self._make(f"{type_name}_SendGoal_Response", accepted=accepted, stamp=stamp)

    def _goal_info(self, goal: ServedGoal) -> Message:
        stamp = ns_to_stamp(goal.stamp_ns)
        return self._make("action_msgs/msg/GoalInfo", goal_id=self._uuid(goal.uuid), stamp=stamp)

    def _uuid(self, uuid: bytes) -> Message:
        return self._make("unique_identifier_msgs/msg/UUID", uuid=np.frombuffer(uuid, np.uint8))

    def _decode(self, question: Question, type_name: str) -> Message:
        return self._codec.decode(question.payload, type_name)

    def _make(self, type_name: str, **fields: object) -> Message:
        return self._codec.make(type_name, **fields)


def _usable(message: Message) -> Pose2 | None:
    """Nav2 accepts a pose that it cannot use and aborts it at once, with code 0."""
    try:
        return pose_of(message)
    except WireError:
        return None
