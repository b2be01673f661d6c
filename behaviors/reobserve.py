"""One bounded re-observation of a candidate: turn to face it, then one short move to its next-best goal pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array
from openbelief.goal_pose import GoalPose
from openbelief.pose import Pose2, wrap_angle

MOVE_MAX_M = 1.5
FACING_RAD = np.deg2rad(10.0)  # a turn smaller than this shows nothing new


@dataclass(frozen=True, slots=True)
class Look:
    """Where to look from next; expected_visibility is None for a turn in place."""

    pose: Pose2
    expected_visibility: float | None
    reason: str

    @property
    def is_move(self) -> bool:
        return self.expected_visibility is not None


class ReObservation:
    """The looks left for one candidate: at most one turn and one move, each given once.

    centroid: (3,) map frame, metres. others: goal poses that were not driven to yet, best first.
    """

    def __init__(self, centroid: Array) -> None:
        self._centroid = centroid
        self._turned = self._moved = False

    def next_look(self, robot: Pose2, others: Sequence[GoalPose]) -> Look | None:
        """The next look from where the robot is, None when there is none left."""
        if not self._turned:
            self._turned = True
            facing = _facing(robot, self._centroid)
            if abs(wrap_angle(facing - robot.yaw)) > FACING_RAD:
                return Look(Pose2(robot.x, robot.y, facing), None, "turn in place to face it")
        if self._moved:
            return None
        self._moved = True
        near = (other for other in others if other.pose.distance_to(robot) <= MOVE_MAX_M)
        if (best := next(near, None)) is None:
            return None
        return Look(best.pose, best.expected_visibility, f"move {best.pose.distance_to(robot):.1f} m to see it better")


def _facing(robot: Pose2, centroid: Array) -> float:
    return float(np.arctan2(centroid[1] - robot.y, centroid[0] - robot.x))
