"""Is something in the way that the map does not know? Goal, first metres of the way and arrival, against one cloud."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array
from openbelief.occupancy import OBSTACLE_MAX_M, OBSTACLE_MIN_M
from openbelief.polyline import resampled
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid
from openbelief.walkable import Walkable

SELF_M = 0.35  # nearer to the robot's middle are its own shoulders and arms
MAPPED_M = 0.15  # a point this near to an obstacle of the map is that obstacle
GOAL_M = 0.35  # room that the robot needs where it is going to stand
WAY_M = 0.25  # and to either side of the path's middle: its body
CROWDED_M = 0.5  # at arrival: something new this near leaves no room to turn in
WAY_STEP_M = 0.05  # planners may give points far apart
MIN_POINTS = 5  # fewer are noise


def unmapped(points: Array, grid: OccupancyGrid, robot: Pose2) -> Array:
    """(m, 2) map points of obstacles, high enough to bump into, that stand on floor which the map calls free.

    points: (n, 3), map frame, metres, floor at z = 0.
    """
    high = (points[:, 2] > OBSTACLE_MIN_M) & (points[:, 2] < OBSTACLE_MAX_M)
    xy = points[high, :2].astype(np.float64)
    xy = xy[np.linalg.norm(xy - robot.xy, axis=1) > SELF_M]
    cells = grid.cell(xy)
    on_map = grid.contains(cells)
    margin = Walkable(grid, MAPPED_M)
    return xy[on_map][margin.free(margin.flat(cells[on_map]))]


def goal_blocked(obstacles: Array, goal: Pose2) -> str | None:
    """A sentence where there is no room to stand at the goal. obstacles: (m, 2), as `unmapped` gives them."""
    count = _within(obstacles, goal.xy, GOAL_M)
    said = f"Something that the map does not know stands where the robot would ({count} lidar points)."
    return said if count else None


def way_blocked(obstacles: Array, way: Array) -> str | None:
    """A sentence where something stands on the way, (n, 2) points along its middle, joined by straight lines."""
    if not len(way) or not len(obstacles):
        return None
    after, middle = resampled(np.asarray(way, np.float64), WAY_STEP_M)
    near = np.linalg.norm(obstacles[:, None] - middle[None], axis=2) < WAY_M
    if near.any(axis=1).sum() < MIN_POINTS:
        return None
    after_m = after[np.flatnonzero(near.any(axis=0))[0]]
    return f"Something that the map does not know stands on the way, {after_m:.1f} m from here."


def crowded(obstacles: Array, robot: Pose2) -> str | None:
    """A sentence where something new stands so near that the robot has no room to turn."""
    count = _within(obstacles, robot.xy, CROWDED_M)
    return f"Something stands within {CROWDED_M:g} m of the robot ({count} lidar points)." if count else None


def _within(obstacles: Array, xy: Array, radius_m: float) -> int:
    """How many obstacle points lie there, 0 where they are too few to be anything."""
    count = int((np.linalg.norm(obstacles - xy, axis=1) < radius_m).sum())
    return count if count >= MIN_POINTS else 0
