"""A planar grid from lidar and depth points, for where there is no Nav2 map."""

from __future__ import annotations

import cv2
import numpy as np

from openbelief.arrays import Array, points_array
from openbelief.traversability import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

RESOLUTION_M = 0.05
FLOOR_BAND_M = 0.10  # a hit this near the floor's height is floor
OBSTACLE_MIN_M, OBSTACLE_MAX_M = 0.2, 1.5  # above the floor: what a G1 cannot step over, and what it cannot walk under
MIN_HITS = 2  # one stray return is no obstacle
MAX_SIDE_M = 500.0


class TooWide(ValueError):
    """Points of more than one site."""


def from_points(points: Array) -> OccupancyGrid:
    """Cells with an obstacle are occupied, cells with floor and none are free, the rest is unknown and so not free.

    points: (n, 3), map frame, metres: every hit of the walk, not voxel-snapped. Raises ValueError on misshapen or
    non-finite points, TooWide on absurdly spread ones.
    """
    cloud = points_array(points)
    height = cloud[:, 2] - floor_height(cloud)
    relevant = (height > -FLOOR_BAND_M) & (height < OBSTACLE_MAX_M)
    xy, height = cloud[relevant, :2].astype(np.float64), height[relevant]
    low = np.floor(xy.min(axis=0) / RESOLUTION_M)
    size = (np.floor(xy.max(axis=0) / RESOLUTION_M) - low + 1).astype(np.int64)
    if (size * RESOLUTION_M > MAX_SIDE_M).any():
        raise TooWide(
            f"The points span {size.max() * RESOLUTION_M:.0f} m; a map of one site spans {MAX_SIDE_M:.0f} m at most."
        )
    origin = low * RESOLUTION_M
    column, row = np.floor(xy / RESOLUTION_M).astype(np.int64).T - low.astype(np.int64)[:, None]
    flat, shape = np.ravel_multi_index((row, column), tuple(size[::-1])), tuple(size[::-1])

    obstacle = height > OBSTACLE_MIN_M
    occupied = (np.bincount(flat[obstacle], minlength=size.prod()) >= MIN_HITS).reshape(shape)
    floor = np.bincount(flat[np.abs(height) <= FLOOR_BAND_M], minlength=size.prod()).reshape(shape) > 0
    highest = np.full(size.prod(), -np.inf, np.float32)
    np.maximum.at(highest, flat[obstacle], height[obstacle])
    return OccupancyGrid(
        cells=np.where(occupied, OCCUPIED, np.where(_closed(floor), FREE, UNKNOWN)).astype(np.int8),
        resolution_m=RESOLUTION_M,
        origin_xy=(float(origin[0]), float(origin[1])),
        heights_m=np.where(occupied, highest.reshape(shape), np.nan).astype(np.float32),
    )


def floor_height(points: Array) -> float:
    """The z of the floor: the fullest 4 cm in the half metre above the lowest (but 1 %: reflections lie deeper)."""
    z = points[:, 2].astype(np.float64)
    lowest = float(np.quantile(z, 0.01))
    near = z[(z >= lowest - 0.05) & (z <= lowest + 0.5)]
    counts, edges = np.histogram(near, bins=np.arange(lowest - 0.05, lowest + 0.54, 0.04))
    fullest = int(np.argmax(counts))
    return float(np.median(near[(near >= edges[fullest]) & (near <= edges[fullest + 1])]))


def _closed(floor: Array) -> Array:
    """Gaps of up to two cells between floor hits are floor: a lidar's rings are that far apart."""
    padded, beside = np.pad(floor, 1).astype(np.uint8), np.ones((3, 3), np.uint8)
    closed = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, beside, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    return closed[1:-1, 1:-1].astype(bool)
