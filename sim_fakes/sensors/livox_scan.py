"""What the emulated MID-360 sees: its directions over time, and a room to see with them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from openbelief.arrays import Array

# (n, 3) unit directions in the lidar frame and the lidar's uptime in ns -> (n,) ranges in metres; 0 or not finite = no
# return. A simulated world plugs in here: lambda directions, uptime_ns: renderer.scan(robot.T_map_lidar(), directions)
RangeSource: TypeAlias = Callable[[Array, int], Array]

LOWEST_DEG, HIGHEST_DEG = -7.0, 52.0  # the MID-360's field of view; all around in azimuth
TURN = 0.00613  # turns of azimuth a point
CLIMB = 0.7548776662466927  # irrational, so that the pattern does not repeat


def directions(first: int, count: int) -> Array:
    """(count, 3) unit directions of the points numbered from `first`."""
    number = np.arange(first, first + count, dtype=float)
    azimuth = 2 * np.pi * (number * TURN % 1.0)
    low, high = np.sin(np.radians([LOWEST_DEG, HIGHEST_DEG]))
    z = low + (high - low) * (number * CLIMB % 1.0)
    level = np.sqrt(1 - z**2)
    return np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), z])


def open_room(rays: Array, uptime_ns: int) -> Array:  # noqa: ARG001 - nothing moves in this room
    """Ranges in a 6 m x 4 m room with 2.4 m walls and no ceiling, the lidar 1.2 m above the floor at its centre."""
    with np.errstate(divide="ignore"):
        to_wall = np.minimum(3.0 / np.abs(rays[:, 0]), 2.0 / np.abs(rays[:, 1]))
        to_floor = np.where(rays[:, 2] < 0, -1.2 / rays[:, 2], np.inf)
    ranges = np.minimum(to_wall, to_floor)
    return np.where(ranges * rays[:, 2] > 1.2, 0.0, ranges)
