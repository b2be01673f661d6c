"""Nav2 behind the bridge, simulated: NavigateToPose, ComputePathToPose and is_active, driving a SimRobot on its map."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable
from typing import Protocol

import numpy as np

from drivers.clock import SimClock
from drivers.ros import action
from drivers.ros.messages import Message, WireError, codec
from drivers.topics import COMPUTE_PATH_TO_POSE, IS_ACTIVE, NAVIGATE_TO_POSE, Action
from openbelief.arrays import Array
from openbelief.polyline import path_length
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid
from sim_fakes.wire.faults import GARBAGE, Nav2Faults
from sim_fakes.wire.nav2_messages import NAVIGATE, PLAN, Nav2Messages, ServedGoal, usable_pose
from sim_fakes.wire.nav2_planner import PlanFailed, SimPlanner
from sim_fakes.wire.sim_bridge import PendingQuery, SimBridge

TICK_S = 0.1
FEEDBACK_TICKS = 5  # feedback twice a second
NO_PROGRESS = 105  # Nav2's error code


class GoalRunner(Protocol):
    """What Nav2 needs of the robot."""

    @property
    def believed_pose(self) -> Pose2: ...

    @property
    def moving(self) -> bool: ...

    def follow(self, path_xy: Array, final_yaw: float) -> None: ...

    def halt(self) -> None: ...


class SimNav2Server:
    """The action servers. Planning takes no simulated time; driving takes as long as the robot needs.

    Questions are answered on Zenoh's threads, progress is made by the clock.
    """

    def __init__(
        self,
        bridge: SimBridge,
        clock: SimClock,
        robot: GoalRunner,
        grid: OccupancyGrid,
        faults: Nav2Faults | None = None,
        *,
        distribution: str = "jazzy",
    ) -> None:
        self._bridge, self._clock, self._robot = bridge, clock, robot
        self.faults = faults or Nav2Faults()
        self._planner = SimPlanner(grid)
        self.speak(distribution)
        self._goals: dict[bytes, ServedGoal] = {}
        self._plans: dict[bytes, Message] = {}
        self._kept: list[PendingQuery] = []  # lost on purpose: a query ends when nobody holds it
        self._lock = threading.RLock()
        self._ticks = 0
        self.accepted = 0
        self.asked: Counter[str] = Counter()  # questions by part, as in Nav2Faults

    def start(self) -> None:
        """Declare everything and begin to drive."""
        self._serve(NAVIGATE_TO_POSE, "send_goal", self._send_goal)
        self._serve(NAVIGATE_TO_POSE, "get_result", self._get_result)
        self._serve(NAVIGATE_TO_POSE, "cancel_goal", self._cancel_goal)
        self._serve(COMPUTE_PATH_TO_POSE, "send_goal", self._send_plan)
        self._serve(COMPUTE_PATH_TO_POSE, "get_result", self._get_plan)
        self._bridge.answer(self._bridge.keys.service(IS_ACTIVE), self._is_active)
        self._bridge.offer(NAVIGATE_TO_POSE)
        self._bridge.offer(COMPUTE_PATH_TO_POSE)
        self._publish_status()
        self._clock.every(TICK_S, self._tick)

    # What a drill can do

    def speak(self, distribution: str) -> None:
        """From now on in the shapes of that ROS distribution."""
        self._codec = codec(distribution)
        self._say = Nav2Messages(self._codec)

    def preempt(self) -> None:
        """Another client sends a goal to where the robot stands."""
        self.drive(self._robot.believed_pose)

    def drive(self, pose: Pose2, uuid: bytes = bytes(15) + b"\x01") -> None:
        """Another client sends a goal."""
        with self._lock:
            self._accept(ServedGoal(uuid, pose, self._clock.now_ns()))

    def claim(self, status: int) -> None:
        """The goal under way is said to have ended so, by its status and its result, and the robot drives on."""
        with self._lock:
            for goal in [g for g in self._goals.values() if g.status in action.ACTIVE]:
                goal.claimed = status
                self._publish_status()
                self._release(goal)

    def restart(self) -> None:
        """Nav2's process dies and comes back: the robot stops and no goal is known any more."""
        with self._lock:
            self._robot.halt()
            for goal in self._goals.values():
                self._release(goal)
            self._goals.clear()
            self._publish_status()

    # Questions

    def _serve(self, served: Action, part: str, handler: Callable[[PendingQuery], None]) -> None:
        key = self._bridge.keys.action(served, part)

        def serve(question: PendingQuery) -> None:
            with self._lock:
                self.asked["plan" if served is COMPUTE_PATH_TO_POSE else part] += 1
            try:
                handler(question)
            except WireError:
                question.drop()  # the bridge logs a request it cannot read, and answers nothing

        self._bridge.answer(key, serve)

    def _send_goal(self, question: PendingQuery) -> None:
        request = self._decode(question, f"{NAVIGATE}_SendGoal_Request")
        uuid = bytes(request.goal_id.uuid)
        with self._lock:
            accepted = uuid not in self._goals and not self.faults.reject
            if accepted:
                self._accept(ServedGoal(uuid, usable_pose(request.goal.pose), self._clock.now_ns()))
        self._reply("send_goal", question, self._say.accepted(NAVIGATE, accepted, self._clock.now_ns()))

    def _get_result(self, question: PendingQuery) -> None:
        request = self._decode(question, f"{NAVIGATE}_GetResult_Request")
        with self._lock:
            goal = self._goals.get(bytes(request.goal_id.uuid))
            if goal is not None and goal.said in action.ACTIVE:
                goal.waiting.append(question)
                return
        self._reply("get_result", question, self._say.result(goal))

    def _cancel_goal(self, question: PendingQuery) -> None:
        request = self._decode(question, f"{action.CANCEL}_Request")
        uuid = bytes(request.goal_info.goal_id.uuid)
        with self._lock:
            code, canceling = self._cancelled(uuid)
            for goal in canceling:
                self._end(goal, action.CANCELED)
        self._reply("cancel_goal", question, self._say.cancelled(code, canceling))

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

    def _send_plan(self, question: PendingQuery) -> None:
        request = self._decode(question, f"{PLAN}_SendGoal_Request")
        uuid = bytes(request.goal_id.uuid)
        with self._lock:
            accepted = uuid not in self._plans and not self.faults.reject
            if accepted:
                self._plans[uuid] = self._planned(usable_pose(request.goal.goal))
        self._reply("plan", question, self._say.accepted(PLAN, accepted, self._clock.now_ns()))

    def _get_plan(self, question: PendingQuery) -> None:
        request = self._decode(question, f"{PLAN}_GetResult_Request")
        self._reply("plan", question, self._plans.get(bytes(request.goal_id.uuid), self._say.unknown_plan()))

    def _planned(self, pose: Pose2 | None) -> Message:
        try:
            return self._say.path(self._path(pose), self._clock.now_ns())
        except PlanFailed as failed:
            return self._say.no_path(*failed.args)

    def _is_active(self, question: PendingQuery) -> None:
        self._reply("is_active", question, self._say.active(not self.faults.inactive))

    # Driving

    def _accept(self, goal: ServedGoal) -> None:
        """A new goal replaces the one under way, which then ends as aborted with code 0.

        As in Nav2 the status tells of the new goal before the old one's result is given.
        """
        replaced = [other for other in self._goals.values() if other.status in action.ACTIVE]
        self._goals[goal.uuid] = goal
        self.accepted += 1
        self._publish_status()
        for other in replaced:
            self._end(other, action.ABORTED)
        if goal.pose is not None and not self.faults.stuck:
            try:
                goal.path = self._path(goal.pose)
                self._robot.follow(goal.path[1:], goal.pose.yaw)
            except PlanFailed as failed:
                goal.error = failed.args

    def _path(self, pose: Pose2 | None) -> Array:
        """From the robot to the pose; raises PlanFailed."""
        return self._planner.path(self._robot.believed_pose.xy, pose)

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
            self._reply("get_result", question, self._say.result(goal))
        goal.waiting.clear()

    # Wire

    def _reply(self, part: str, question: PendingQuery, message: Message) -> None:
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
        if not self.faults.silent:
            self._put("status", self._say.statuses(self._goals.values()), latched=True)

    def _publish_feedback(self, goal: ServedGoal) -> None:
        now_ns = self._clock.now_ns()
        message = self._say.feedback(goal, self._robot.believed_pose, self._remaining(goal), now_ns)
        self._put("feedback", message)

    def _put(self, part: str, message: Message, *, latched: bool = False) -> None:
        key = self._bridge.keys.action(NAVIGATE_TO_POSE, part)
        self._bridge.put(key, self._codec.encode(message), latched=latched)

    def _remaining(self, goal: ServedGoal) -> float:
        """Metres left of the path, from its point nearest to the robot."""
        if len(goal.path) == 0:
            return 0.0
        nearest = int(np.argmin(np.linalg.norm(goal.path - self._robot.believed_pose.xy, axis=1)))
        return path_length(goal.path[nearest:])

    def _decode(self, question: PendingQuery, type_name: str) -> Message:
        return self._codec.decode(question.payload, type_name)
