"""Rooms as regions of a planar grid: walls and doorways bound them, a watershed divides what is still connected."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.basins import divided, nearest_label
from openbelief.traversability import OCCUPIED, UNKNOWN, OccupancyGrid
from openbelief.wall_map import wall_map

INTO_WALLS_M = 0.8  # walls and what stands at them belong to the nearest room
CORNER_M = 0.05  # corners of a polygon are so exact
SHADOW_CELLS = 3000  # so many tell the walls' angle as well as all do
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
    labels = turn.back(_into_walls(divided(walls.floor, grid.resolution_m), known, grid.resolution_m))
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
    cells = np.argwhere(occupied)[:, ::-1]
    points = cells[:: max(1, len(cells) // SHADOW_CELLS)].astype(np.float32)
    if len(points) < 2:
        return 0.0
    angles = np.arange(-45.0, 45.0, 1.0)
    coarse = angles[np.argmax(_sharpness(points, angles))]
    angles = coarse + np.arange(-1.0, 1.01, 0.25)
    best = angles[np.argmax(_sharpness(points, angles))]
    return 0.0 if abs(best) < ALIGNED_DEG else float(best)


def _sharpness(points: Array, angles_deg: Array) -> Array:
    """(n,) for each angle: the sum of squares of how many cells fall together along either of its axes."""
    along = np.deg2rad(np.concatenate((angles_deg, angles_deg + 90.0)))
    shadows = points @ np.stack((np.cos(along), np.sin(along))).astype(np.float32)
    shadows -= shadows.min(axis=0)
    length = int(shadows.max()) + 1
    counts = np.bincount((shadows.astype(np.int32) + np.arange(len(along)) * length).ravel())
    squares = np.square(np.pad(counts, (0, len(along) * length - len(counts))).reshape(2, -1, length), dtype=np.float64)
    return squares.sum(axis=(0, 2))


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


def _into_walls(labels: Array, known: Array, resolution_m: float) -> Array:
    """Known cells without a room get the nearest one."""
    away, nearest = nearest_label(labels)
    return np.where(known & (away * resolution_m <= INTO_WALLS_M), nearest, labels)
