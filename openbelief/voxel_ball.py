"""The voxels within r of a cloud: its own, grown by a ball."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np

from openbelief.arrays import Array

ROUNDING_M = 1e-6  # float32 coordinates exactly r apart are within r
MAX_STEP = 4  # voxels: where r is more, the ball is larger than a tree's search
DENSE = 64  # cells for each voxel, up to which moving the whole grid is faster than stepping from every voxel
SMALL = 1 << 14  # cells of a grid that is moved in no time


@dataclass(frozen=True)
class VoxelBall:
    """The steps between voxels whose centres are within r; none where r is too many voxels.

    columns: the ball as (x, y, z): from `z` steps down to `z` up. slack_m: how far points may be off their voxels'
    centres along an axis for the ball to decide as they do; less than none where it has no step.
    """

    columns: tuple[tuple[int, int, int], ...] = field(repr=False)
    slack_m: float

    @cached_property
    def reach(self) -> int:
        """Its longest step along an axis, voxels."""
        return max((z for _, _, z in self.columns), default=0)

    def grown(self, at: Array, sides: Array) -> Array:
        """(cells,) bool: the cells of a grid within r of its (k,) cells `at`, each at least `reach` from its borders.

        sides: (3,) cells; z runs fastest.
        """
        cells, (_, y_side, z_side) = int(sides.prod()), sides.tolist()
        moves = [((x * y_side + y) * z_side, z) for x, y, z in self.columns]
        return (_moved if cells <= max(DENSE * len(at), SMALL) else _stepped)(at, moves, cells)


def _moved(at: Array, moves: list[tuple[int, int]], cells: int) -> Array:
    """The whole grid, smeared up and down, is laid over itself once for every column."""
    smeared = [np.zeros(cells, bool)]
    smeared[0][at] = True
    for steps in range(1, max(z for _, z in moves) + 1):
        smeared.append(smeared[-1].copy())
        for move in (-steps, steps):
            _lay(smeared[0], move, smeared[steps])
    grown = np.zeros(cells, bool)
    for move, z in moves:
        _lay(smeared[z], move, grown)
    return grown


def _lay(grid: Array, move: int, over: Array) -> None:
    """`grid`, moved by so many cells, over another one; what would leave it is empty."""
    if move > 0:
        over[move:] |= grid[:-move]
    elif move < 0:
        over[:move] |= grid[-move:]
    else:
        over |= grid


def _stepped(at: Array, moves: list[tuple[int, int]], cells: int) -> Array:
    """From every voxel, every step is taken."""
    grown = np.zeros(cells, bool)
    for move, z in moves:
        for step in range(move - z, move + z + 1):
            grown[at + step] = True
    return grown


@lru_cache(maxsize=16)
def voxel_ball(radius_m: float, voxel_m: float) -> VoxelBall:
    """Two points each off their voxels' centres by `slack_m` are at most 2 sqrt(3) times it nearer or farther than the
    centres, which is less than from r to any distance between centres."""
    reach_m, most = radius_m + ROUNDING_M, int((radius_m + ROUNDING_M) / voxel_m) + 1
    if most > MAX_STEP + 1:
        return VoxelBall((), -1.0)
    steps = np.stack(np.meshgrid(*[np.arange(-most, most + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    length_m = np.linalg.norm(steps, axis=1) * voxel_m
    columns = {(x, y): z for x, y, z in steps[length_m <= reach_m].tolist()}  # the last is the highest
    slack_m = float(np.abs(length_m - reach_m).min() / (2 * np.sqrt(3)))
    return VoxelBall(tuple((x, y, z) for (x, y), z in columns.items()), slack_m)
