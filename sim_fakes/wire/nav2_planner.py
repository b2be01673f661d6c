"""The planner of the simulated Nav2: a path over the map, with as much room beside the body as there is."""

from __future__ import annotations

from openbelief.arrays import Array
from openbelief.g1 import BODY_RADIUS_M
from openbelief.pose import Pose2
from openbelief.traversability import NoPath, OccupancyGrid, path

MARGINS_M = (0.15, 0.08, 0.03)  # beyond the body, the widest first: a robot that walks cuts corners
GOAL_OUTSIDE, GOAL_OCCUPIED, NO_PATH = 204, 206, 208


class PlanFailed(Exception):
    """No path; args: Nav2's error code and message."""


class SimPlanner:
    """ComputePathToPose over one map."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grids = [grid.inflated(BODY_RADIUS_M + margin) for margin in MARGINS_M]

    def path(self, start_xy: Array, goal: Pose2 | None) -> Array:
        """(n, 2) points from the start to the goal, map frame, metres; raises PlanFailed. None: no usable pose."""
        if goal is None:
            raise PlanFailed(0, "")
        grid = self._grids[-1]
        if not grid.contains(grid.cell(goal.xy)):
            raise PlanFailed(GOAL_OUTSIDE, "goal outside the map")
        if not grid.free[tuple(grid.cell(goal.xy))]:
            raise PlanFailed(GOAL_OCCUPIED, "goal occupied")
        for inflated in self._grids:
            try:
                return path(inflated, start_xy, goal.xy)
            except NoPath as error:
                reason = str(error)
        raise PlanFailed(NO_PATH, reason)
