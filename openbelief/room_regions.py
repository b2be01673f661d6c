"""Rooms as regions of a planar grid: walls and doorways bound them, a watershed divides what is still connected."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.traversability import OCCUPIED, UNKNOWN, OccupancyGrid
from openbelief.wall_map import WallMap, wall_map

PEAK_M, PEAK_APART_M = 0.4, 0.6  # the middle of a region is so far from its walls, and from the next one's middle
NARROW = 0.65  # a passage narrower than this share of both sides' widths divides them
WIDE_M = 1.3  # one whose middle is so far from the walls does not
ROOM_MIN_M2 = 2.0
INTO_WALLS_M = 0.8  # walls and what stands at them belong to the nearest room
CORNER_M = 0.05  # corners of a polygon are so exact
ALIGNED_DEG = 0.75  # a grid whose walls are nearer to its axes is taken as it is


@dataclass(frozen=True)
class Regions:
    """labels: (h, w) int, 0 where there is no room, 1 to count. walls: (h, w) bool, on the same grid."""

    labels: Array
    count: int
    walls: Array

    def polygon(self, label: int, grid: OccupancyGrid) -> Array:
        """(n, 2) corners of a region's outline, map frame, metres, counter-clockwise."""
        region = (self.labels == label).astype(np.uint8)
        fine = cv2.resize(region, None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST)  # outlines run along cells' edges
        outlines, _ = cv2.findContours(np.pad(fine, 1), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        outline = max(outlines, key=cv2.contourArea)
        corners = cv2.approxPolyDP(outline, 2 * CORNER_M / grid.resolution_m, closed=True)[:, 0, :]
        xy = (corners - 0.5) / 2 * grid.resolution_m + np.asarray(grid.origin_xy)
        return np.round(xy, 3)


def room_regions(grid: OccupancyGrid, clouds: Iterable[Array]) -> Regions:
    """The grid's rooms. clouds: (n, 3) points of each mapped object, map frame; what stands there is no wall."""
    objects = cells_under(grid, clouds)
    turn = _Turn(wall_angle_deg(grid.cells >= OCCUPIED), grid.cells.shape)
    walls = wall_map(turn.there(grid.cells, UNKNOWN), turn.there(objects, 0).astype(bool), grid.resolution_m)
    known = turn.there(grid.cells, UNKNOWN) != UNKNOWN
    labels = turn.back(_into_walls(_divided(walls, grid.resolution_m), known, grid.resolution_m))
    kept = [label for label in np.unique(labels) if label > 0]
    order = sorted(kept, key=lambda label: tuple(np.argwhere(labels == label).mean(axis=0)))
    numbered = np.zeros(int(labels.max(initial=0)) + 1, np.int64)
    numbered[order] = np.arange(1, len(order) + 1)
    return Regions(numbered[labels], len(order), turn.back(walls.walls.astype(np.int16)).astype(bool))


def cells_under(grid: OccupancyGrid, clouds: Iterable[Array]) -> Array:
    """(h, w) bool: the cells under points (n, 3) of the map, gaps of a cell closed."""
    under = np.zeros(grid.cells.shape, np.uint8)
    for points in clouds:
        cells = grid.cell(points[:, :2])
        under[tuple(cells[grid.contains(cells)].T)] = 1
    return cv2.morphologyEx(under, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)).astype(bool)


def wall_angle_deg(occupied: Array) -> float:
    """In (-45, 45]: how far the walls are turned against the grid, by where the cells' shadows are sharpest."""
    points = np.argwhere(occupied)[:, ::-1].astype(np.float64)
    if len(points) < 2:
        return 0.0
    angles = np.arange(-45.0, 45.0, 1.0)
    best = angles[int(np.argmax([_sharpness(points, a) for a in angles]))]
    angles = best + np.arange(-1.0, 1.01, 0.25)
    best = angles[int(np.argmax([_sharpness(points, a) for a in angles]))]
    return 0.0 if abs(best) < ALIGNED_DEG else float(best)


def _sharpness(points: Array, angle_deg: float) -> float:
    a = np.deg2rad(angle_deg)
    turned = points @ np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    cells = np.floor(turned - turned.min(axis=0)).astype(np.int64)
    return float(sum((np.bincount(cells[:, axis]).astype(np.float64) ** 2).sum() for axis in (0, 1)))


class _Turn:
    """Images turned until walls run along the axes, and back."""

    def __init__(self, angle_deg: float, shape: tuple[int, ...]) -> None:
        self._angle_deg, self._shape = angle_deg, shape
        height, width = shape
        matrix = cv2.getRotationMatrix2D((width / 2 - 0.5, height / 2 - 0.5), angle_deg, 1.0)
        cosine, sine = abs(matrix[0, 0]), abs(matrix[0, 1])
        self._size = (int(height * sine + width * cosine) + 2, int(height * cosine + width * sine) + 2)
        matrix[0, 2] += (self._size[0] - width) / 2
        matrix[1, 2] += (self._size[1] - height) / 2
        self._matrix = matrix

    def there(self, image: Array, outside: int) -> Array:
        if not self._angle_deg:
            return image
        return self._warped(image, self._matrix, self._size, outside)

    def back(self, image: Array) -> Array:
        if not self._angle_deg:
            return image.astype(np.int64)
        height, width = self._shape
        return self._warped(image, cv2.invertAffineTransform(self._matrix), (width, height), 0).astype(np.int64)

    def _warped(self, image: Array, matrix: Array, size: tuple[int, int], outside: int) -> Array:
        whole = image.astype(np.int16)
        return cv2.warpAffine(whole, matrix, size, flags=cv2.INTER_NEAREST, borderValue=outside)


def _divided(walls: WallMap, resolution_m: float) -> Array:
    """(h, w) int: a watershed over the distance to walls and doors, its basins joined where the way between is wide."""
    from scipy.ndimage import distance_transform_edt, label, maximum_filter, watershed_ift

    distance_m = distance_transform_edt(np.pad(walls.floor, 1))[1:-1, 1:-1] * resolution_m
    size = max(1, round(PEAK_APART_M / resolution_m))
    peaks, count = label((distance_m == maximum_filter(distance_m, size)) & (distance_m > PEAK_M), np.ones((3, 3)))
    if not count:
        return np.zeros(walls.floor.shape, np.int64)
    depth = np.minimum(distance_m / resolution_m * 20, 9999)
    cost = np.where(walls.floor, 10000 - depth, 65535).astype(np.uint16)
    basins = np.where(walls.floor, watershed_ift(cost, peaks.astype(np.int32)), 0)
    return _without_small(_joined(basins, distance_m), resolution_m)


def _joined(basins: Array, distance_m: Array) -> Array:
    """Basins become one where the highest pass between them is not much lower than both peaks, highest first."""
    count = int(basins.max())
    height = np.zeros(count + 1)
    np.maximum.at(height, basins.ravel(), distance_m.ravel())
    parent = list(range(count + 1))

    def root(i: int) -> int:
        while parent[i] != i:
            i = parent[i]
        return i

    for (a, b), pass_m in sorted(_passes(basins, distance_m).items(), key=lambda item: (-item[1], item[0])):
        a, b = root(a), root(b)
        if a != b and (pass_m >= WIDE_M or pass_m >= NARROW * min(height[a], height[b])):
            parent[b], height[a] = a, max(height[a], height[b])
    return np.array([root(i) for i in range(count + 1)])[basins]


def _passes(basins: Array, distance_m: Array) -> dict[tuple[int, int], float]:
    """Neighbouring basins (a < b) -> the greatest distance to a wall on their common border."""
    passes: dict[tuple[int, int], float] = {}
    for down, right in ((0, 1), (1, 0)):
        here = (slice(0, basins.shape[0] - down), slice(0, basins.shape[1] - right))
        there = (slice(down, None), slice(right, None))
        border = (basins[here] != basins[there]) & (basins[here] > 0) & (basins[there] > 0)
        sides = np.sort(np.stack((basins[here][border], basins[there][border])), axis=0)
        for a, b, low in zip(*sides.tolist(), np.minimum(distance_m[here], distance_m[there])[border], strict=True):
            passes[a, b] = max(passes.get((a, b), 0.0), float(low))
    return passes


def _without_small(basins: Array, resolution_m: float) -> Array:
    """A region too small for a room joins the one that it borders most on; one that borders on none goes."""
    basins = basins.copy()
    while True:
        sizes = np.bincount(basins.ravel())
        sizes[0] = 0
        small = np.flatnonzero((sizes > 0) & (sizes * resolution_m**2 < ROOM_MIN_M2))
        if not len(small):
            return basins
        smallest = small[np.argmin(sizes[small])]
        region = basins == smallest
        ring = cv2.dilate(region.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool) & ~region
        around = basins[ring & (basins > 0)]
        basins[region] = np.bincount(around).argmax() if len(around) else 0


def _into_walls(labels: Array, known: Array, resolution_m: float) -> Array:
    """Known cells without a room get the nearest one."""
    from scipy.ndimage import distance_transform_edt

    if not labels.any():
        return labels
    away, (row, column) = distance_transform_edt(labels == 0, return_indices=True)
    near = known & (away * resolution_m <= INTO_WALLS_M)
    return np.where(near, labels[row, column], labels)
