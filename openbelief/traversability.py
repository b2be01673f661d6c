"""Where the robot can stand: a planar grid from lidar and depth points, or from nav_msgs/OccupancyGrid."""

from __future__ import annotations

from dataclasses import dataclass

from openbelief.arrays import Array

FREE, OCCUPIED, UNKNOWN = 0, 100, -1  # nav_msgs/OccupancyGrid


@dataclass(frozen=True)
class OccupancyGrid:
    """A grid aligned with the map axes. cells: (h, w) int8, row = y, column = x; cell (0, 0) has its corner at origin.

    origin_xy: (x, y) of that corner, map frame, metres. Values as nav_msgs/OccupancyGrid: 0 free, 1-100 cost,
    -1 unknown.
    """

    cells: Array
    resolution_m: float
    origin_xy: tuple[float, float]
    stamp_ns: int = 0
