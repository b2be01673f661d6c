"""Floor with room for the robot, worked out tile by tile where somebody asks: a large site costs what is looked at."""

from __future__ import annotations

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.traversability import INSCRIBED, OCCUPIED, UNKNOWN, OccupancyGrid

TILE = 256  # cells
FREE, BLOCKED = 1, 2  # 0: not worked out yet


class Walkable:
    """`grid.inflated(radius_m).free`, by flat cells of the grid with one more cell all round, which is not free."""

    def __init__(self, grid: OccupancyGrid, radius_m: float) -> None:
        self._grid = grid
        self.shape = (grid.cells.shape[0] + 2, grid.cells.shape[1] + 2)
        self.cells = self.shape[0] * self.shape[1]
        self._state = np.zeros(self.cells, np.uint8)  # memory only where it is touched
        self._rectangles = _rectangles(_disc(radius_m, grid.resolution_m))
        self._reach = int(radius_m / grid.resolution_m) + 1

    def flat(self, cells: Array) -> Array:
        """(...) int64 of (..., 2) row and column in the grid."""
        return (cells[..., 0] + 1) * self.shape[1] + cells[..., 1] + 1

    def free(self, flat: Array) -> Array:
        """(...) bool."""
        state = self._state[flat]
        if not state.all():
            self._work_out(np.stack(np.divmod(flat[state == 0], self.shape[1]), axis=1))
            state = self._state[flat]
        return state == FREE

    def window(self, low: Array, high: Array) -> Array:
        """(h, w) bool from the grid's cell `low`, row and column, to before `high`; off the grid nothing is free."""
        size = np.asarray(high) - low
        first = np.maximum(np.asarray(low) + 1, 0)
        last = np.maximum(np.minimum(np.asarray(high) + 1, self.shape), first)
        tiles = [np.arange(a // TILE, -(-b // TILE)) for a, b in zip(first.tolist(), last.tolist(), strict=True)]
        corners = np.stack(np.meshgrid(*tiles, indexing="ij"), axis=-1).reshape(-1, 2) * TILE
        self._work_out(corners[self._state[corners @ [self.shape[1], 1]] == 0])
        out = np.zeros(size, bool)
        inside = tuple(slice(a, b) for a, b in zip(first - low - 1, last - low - 1, strict=True))
        out[inside] = self._state.reshape(self.shape)[first[0] : last[0], first[1] : last[1]] == FREE
        return out

    def open(self, flat: Array) -> None:
        """Cells that the robot may walk all the same: its way out of a margin that it stands in."""
        self.free(flat)
        self._state[flat] = FREE

    def _work_out(self, cells: Array) -> None:
        """All of the tiles that hold (k, 2) cells."""
        for top, left in (np.unique(cells // TILE, axis=0) * TILE).tolist():
            tile = self._state.reshape(self.shape)[top : top + TILE, left : left + TILE]
            np.subtract(BLOCKED, self._free_in(top - 1, left - 1, tile.shape), out=tile)  # FREE is one less

    def _free_in(self, top: int, left: int, shape: tuple[int, ...]) -> Array:
        """(h, w) uint8: 1 where the grid's cells from (top, left), some of them beside it, are free."""
        reach = self._reach
        cells = np.full((shape[0] + 2 * reach, shape[1] + 2 * reach), UNKNOWN, np.int8)
        height, width = self._grid.cells.shape
        first = np.array([top - reach, left - reach])
        low, high = np.maximum(first, 0), np.minimum(first + cells.shape, [height, width])
        inside = tuple(slice(a, b) for a, b in zip(low - first, high - first, strict=True))
        cells[inside] = self._grid.cells[low[0] : high[0], low[1] : high[1]]
        near = self._near((cells >= OCCUPIED).view(np.uint8))
        middle = slice(reach, reach + shape[0]), slice(reach, reach + shape[1])
        free: Array = (cells.view(np.uint8)[middle] < INSCRIBED) & (near[middle] == 0)  # unknown, -1, is 255
        return free.view(np.uint8)

    def _near(self, taken: Array) -> Array:
        """(h, w) uint8: 1 within the radius of a 1. A disc is the union of its rectangles, which are dilated faster."""
        near = np.zeros_like(taken)
        for rectangle in self._rectangles:
            wider = cv2.dilate(taken, rectangle, borderType=cv2.BORDER_CONSTANT, borderValue=0)
            np.maximum(near, wider, out=near)
        return near


def _disc(radius_m: float, resolution_m: float) -> Array:
    """(2 r + 1, 2 r + 1) uint8: 1 for the cells whose centres are within the radius, as `inflated` has it."""
    reach = int(radius_m / resolution_m) + 1
    away = np.arange(-reach, reach + 1)
    return (np.sqrt(away[:, None] ** 2 + away**2) * resolution_m <= radius_m).astype(np.uint8)


def _rectangles(disc: Array) -> list[Array]:
    """The largest of ones, one for each width of the disc's rows: together they cover the disc and nothing else."""
    widths = disc.sum(axis=1)
    heights = {int(width): int((widths >= width).sum()) for width in np.unique(widths[widths > 0])}
    return [np.ones((height, width), np.uint8) for width, height in heights.items()]
