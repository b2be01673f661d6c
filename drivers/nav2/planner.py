"""Nav2's planner: is there a path to a pose? Nothing moves."""

from __future__ import annotations

from collections.abc import Callable

from drivers.nav2.limits import Nav2Limits
from drivers.nav2.result import path_plan
from drivers.ports import LinkLost, PathPlan
from drivers.ros.action import ActionClient, ActionReply
from drivers.ros.convert import pose_message
from openbelief.pose import Pose2


class Nav2Planner:
    """new_uuid gives each question its 16 bytes."""

    def __init__(self, client: ActionClient, limits: Nav2Limits, new_uuid: Callable[[], bytes]) -> None:
        self._client, self._limits, self._new_uuid = client, limits, new_uuid

    def plan(self, goal: Pose2) -> PathPlan:
        """Raises LinkLost or PortError where the planner makes no statement on the path."""
        uuid, taken = self._ask(goal)
        if taken.message is None:  # a question or its answer was lost; planning moves nothing, so it is asked anew
            uuid, taken = self._ask(goal)
        if taken.message is None:
            raise LinkLost(f"Nav2's planner does not answer: {taken.why}.")
        if not taken.message.accepted:
            return PathPlan(None, "Nav2's planner rejected the question: is planner_server active?")
        answer = self._client.get_result(uuid, self._limits.plan_s)
        if answer.message is None:
            raise LinkLost(f"Nav2's planner took the question and gave no path: {answer.why}.")
        return path_plan(answer.message)

    def _ask(self, goal: Pose2) -> tuple[bytes, ActionReply]:
        uuid = self._new_uuid()
        return uuid, self._client.send_goal(uuid, self._limits.send_s, goal=pose_message(goal))
