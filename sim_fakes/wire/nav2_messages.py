"""The messages of the simulated Nav2, in the shapes of one ROS distribution."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from drivers.ros import action
from drivers.ros.convert import path_message, pose_message, pose_of
from drivers.ros.messages import Codec, Message, WireError, ns_to_stamp
from drivers.topics import COMPUTE_PATH_TO_POSE, IS_ACTIVE, NAVIGATE_TO_POSE
from openbelief.arrays import Array
from openbelief.pose import Pose2
from sim_fakes.wire.sim_bridge import PendingQuery

NAVIGATE, PLAN = NAVIGATE_TO_POSE.type_name, COMPUTE_PATH_TO_POSE.type_name


@dataclass
class ServedGoal:
    """A goal at the server. pose: None for one that Nav2 cannot use. waiting: get_result questions to be answered."""

    uuid: bytes
    pose: Pose2 | None
    stamp_ns: int
    status: int = action.EXECUTING
    claimed: int | None = None  # what is said of it instead, to whoever asks
    error: tuple[int, str] = (0, "")
    path: Array = field(default_factory=lambda: np.zeros((0, 2)))
    waiting: list[PendingQuery] = field(default_factory=list)

    @property
    def said(self) -> int:
        return self.status if self.claimed is None else self.claimed


def usable_pose(message: Message) -> Pose2 | None:
    """Nav2 accepts a pose that it cannot use and aborts it at once, with code 0."""
    try:
        return pose_of(message)
    except WireError:
        return None


class Nav2Messages:
    """Builds every reply and sample."""

    def __init__(self, codec: Codec) -> None:
        self._make = codec.make

    def accepted(self, type_name: str, accepted: bool, now_ns: int) -> Message:
        return self._make(f"{type_name}_SendGoal_Response", accepted=accepted, stamp=ns_to_stamp(now_ns))

    def active(self, active: bool) -> Message:
        return self._make(f"{IS_ACTIVE.type_name}_Response", success=active)

    def result(self, goal: ServedGoal | None) -> Message:
        """status 0 for a goal that the server does not know."""
        if goal is None:
            return self._make(f"{NAVIGATE}_GetResult_Response", status=action.UNKNOWN)
        result = self._failed(f"{NAVIGATE}_Result", *goal.error)
        return self._make(f"{NAVIGATE}_GetResult_Response", status=goal.said, result=result)

    def path(self, points: Array, now_ns: int) -> Message:
        result = self._make(f"{PLAN}_Result", path=path_message(points, now_ns))
        return self._make(f"{PLAN}_GetResult_Response", status=action.SUCCEEDED, result=result)

    def no_path(self, code: int, message: str) -> Message:
        result = self._failed(f"{PLAN}_Result", code, message)
        return self._make(f"{PLAN}_GetResult_Response", status=action.ABORTED, result=result)

    def unknown_plan(self) -> Message:
        return self._make(f"{PLAN}_GetResult_Response", status=action.UNKNOWN)

    def cancelled(self, code: int, goals: Iterable[ServedGoal]) -> Message:
        infos = [self._goal_info(goal) for goal in goals]
        return self._make(f"{action.CANCEL}_Response", return_code=code, goals_canceling=infos)

    def statuses(self, goals: Iterable[ServedGoal]) -> Message:
        states = [self._make("action_msgs/msg/GoalStatus", goal_info=self._goal_info(g), status=g.said) for g in goals]
        return self._make(action.STATUS_ARRAY, status_list=states)

    def feedback(self, goal: ServedGoal, pose: Pose2, remaining_m: float, now_ns: int) -> Message:
        seconds, nanoseconds = divmod(now_ns - goal.stamp_ns, 1_000_000_000)
        feedback = self._make(
            f"{NAVIGATE}_Feedback",
            current_pose=pose_message(pose, now_ns),
            navigation_time=self._make("builtin_interfaces/msg/Duration", sec=seconds, nanosec=nanoseconds),
            distance_remaining=remaining_m,
        )
        return self._make(f"{NAVIGATE}_FeedbackMessage", goal_id=self._uuid(goal.uuid), feedback=feedback)

    def _failed(self, type_name: str, code: int, message: str) -> Message:
        """A result with an error, where this distribution's results can say one."""
        result = self._make(type_name)
        if hasattr(result, "error_code"):
            result.error_code, result.error_msg = code, message
        return result

    def _goal_info(self, goal: ServedGoal) -> Message:
        stamp = ns_to_stamp(goal.stamp_ns)
        return self._make("action_msgs/msg/GoalInfo", goal_id=self._uuid(goal.uuid), stamp=stamp)

    def _uuid(self, uuid: bytes) -> Message:
        return self._make("unique_identifier_msgs/msg/UUID", uuid=np.frombuffer(uuid, np.uint8))
