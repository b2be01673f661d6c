"""How much of the mapped floor a walk's camera has measured so far."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array
from openbelief.observation import Intrinsics
from openbelief.pose import apply
from openbelief.traversability import FREE, OccupancyGrid

CELL_M = 0.25
NEAR_M, FAR_M = 0.3, 5.0  # a D435's depth is of use there
EVERY_PIXEL = 8


class Coverage:
    """Cells of 0.25 m that hold free floor by the navigation map, and those of them over which depth was measured."""

    def __init__(self, grid: OccupancyGrid) -> None:
        rows, columns = np.nonzero(grid.cells == FREE)
        free_xy = np.column_stack([columns, rows]) * grid.resolution_m + grid.origin_xy + grid.resolution_m / 2
        self._free = _cells(free_xy)
        self._seen: set[tuple[int, ...]] = set()

    def look(self, depth_m: Array, intrinsics: Intrinsics, T_map_camera: Array) -> None:
        """depth_m: (h, w) metres, aligned to `intrinsics`, 0 where nothing was measured."""
        rows, columns = np.mgrid[0 : depth_m.shape[0] : EVERY_PIXEL, 0 : depth_m.shape[1] : EVERY_PIXEL]
        z = depth_m[rows, columns]
        good = (z > NEAR_M) & (z < FAR_M)
        x = (columns[good] - intrinsics.cx) / intrinsics.fx * z[good]
        y = (rows[good] - intrinsics.cy) / intrinsics.fy * z[good]
        points_map = apply(T_map_camera, np.column_stack([x, y, z[good]]))
        self._seen |= _cells(points_map[:, :2]) & self._free

    @property
    def free_m2(self) -> float:
        return len(self._free) * CELL_M**2

    @property
    def share(self) -> float | None:
        """0 to 1; None where the map has no free floor."""
        return len(self._seen) / len(self._free) if self._free else None


def _cells(xy: Array) -> set[tuple[int, ...]]:
    return {tuple(cell) for cell in np.unique(np.floor(xy / CELL_M).astype(int), axis=0).tolist()}
