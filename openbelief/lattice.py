"""Ways along a lattice: every so many cells of a window, joined where all cells between are free.

Each way on it is one of the floor, so its length is never too short; over open floor both are equally long. A search
over every fourth cell has a sixteenth of the work, and over every cell it is the whole search.
"""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array
from openbelief.walkable import Walkable

STRAIGHT = [(0, 1), (1, 0), (0, -1), (-1, 0)]
DIAGONAL = [(1, 1), (1, -1), (-1, -1), (-1, 1)]  # number i lies between the straight ones i and i + 1
STEPS = np.array(STRAIGHT + DIAGONAL)
LENGTHS = np.hypot(STEPS[:, 0], STEPS[:, 1])[:, None]
BITS = (1 << np.arange(8, dtype=np.uint8))[:, None]
ALL, BUT_FIRST, BUT_LAST = slice(None), slice(1, None), slice(None, -1)
EACH = 8  # rounds: then what leads nowhere is left out


class Lattice:
    """lengths: of the ways found so far, in cells, over (rows + 2) x (columns + 2) points, the outer ones never walked.

    low, high: the window, row and column of the grid, which it covers at least; points lie at multiples of `stride`.
    """

    def __init__(self, walkable: Walkable, low: Array, high: Array, stride: int) -> None:
        self.stride = stride
        self._first = np.floor_divide(low, stride)
        self._shape = np.floor_divide(np.asarray(high) - 1, stride) - self._first + 2  # the last point may lie beyond
        cells = (self._shape - 1) * stride + 1
        moves = _moves(walkable.window(self._first * stride, self._first * stride + cells), stride)
        self._moves = np.pad(moves, 1).ravel()
        self._width = int(self._shape[1]) + 2
        self._steps = (STEPS @ [self._width, 1])[:, None]
        self.lengths = np.full(len(self._moves), np.inf)

    def start(self, cells: Array, lengths: Array) -> None:
        """Ways of (k,) lengths are known to those of (k, 2) cells that are its points, and lead on from there."""
        points, off = np.divmod(cells, self.stride)
        points = points - self._first
        on = np.isfinite(lengths) & (off == 0).all(axis=1) & ((points >= 0) & (points < self._shape)).all(axis=1)
        np.minimum.at(self.lengths, self._flat(points[on]), lengths[on])

    def points(self) -> tuple[Array, Array]:
        """(k, 2) cells of the points that ways lead to, and (k,) their lengths."""
        reached = np.flatnonzero(np.isfinite(self.lengths))
        points = np.stack(np.divmod(reached, self._width), axis=1) - 1
        return (points + self._first) * self.stride, self.lengths[reached]

    def at(self, cells: Array) -> Array:
        """(m,) lengths of the ways to (m, 2) points in the window, inf where none was found."""
        found: Array = self.lengths[self._flat(cells // self.stride - self._first)]
        return found

    def walk(self, bound: float = np.inf, low: Array | None = None, high: Array | None = None) -> None:
        """All shortest ways from where they start; no farther than may lead into the box `low` to `high` by `bound`.

        Bellman and Ford's algorithm by fronts: a point whose way got shorter is walked on from. Over floor nearly every
        point is in one front only, and what remains is the least of all ways' sums, to the bit as Dijkstra's.
        """
        front, place = np.flatnonzero(np.isfinite(self.lengths)), np.zeros(len(self.lengths), np.int32)
        lengths, step = self.lengths, LENGTHS * self.stride
        rounds = 0
        while len(front):
            if low is not None and high is not None and rounds % EACH == 0:
                front = front[self._worthwhile(front, bound, low, high)]
            rounds += 1
            beside, longer = front + self._steps, lengths[front] + step
            better = (self._moves[front] & BITS) != 0
            better &= longer < lengths[beside]
            beside, longer = beside[better], longer[better]
            np.minimum.at(lengths, beside, longer)
            place[beside] = np.arange(len(beside), dtype=np.int32)  # the last of those that are the same cell stays
            front = beside[place[beside] == np.arange(len(beside), dtype=np.int32)]

    def _worthwhile(self, flat: Array, bound: float, low: Array, high: Array) -> Array:
        cells = (np.stack(np.divmod(flat, self._width), axis=1) - 1 + self._first) * self.stride
        keep: Array = self.lengths[flat] + octile(np.maximum(np.maximum(low - cells, cells - high), 0)) <= bound
        return keep

    def _flat(self, points: Array) -> Array:
        return (points[:, 0] + 1) * self._width + points[:, 1] + 1


def octile(steps: Array) -> Array:
    """(...) lengths of the shortest ways over open floor by (..., 2) rows and columns."""
    across = np.abs(steps)
    short = across.min(axis=-1)
    length: Array = across.max(axis=-1) + (np.sqrt(2) - 1) * short
    return length


def _moves(free: Array, stride: int) -> Array:
    """(h, w) uint8 of (stride (h - 1) + 1, ...) free cells: the steps from each point, one bit for each of STEPS."""
    points = free[::stride, ::stride]
    right, down = points[:, :-1].copy(), points[:-1].copy()
    falling, rising = points[:-1, :-1].copy(), points[:-1, 1:].copy()
    for k in range(1, stride + 1):
        right &= free[::stride, k : free.shape[1] - stride + k : stride]
        down &= free[k : free.shape[0] - stride + k : stride, ::stride]
        for row, column in ((k, k - 1), (k - 1, k), (k, k)):  # a diagonal step needs both cells beside it
            falling &= _from(free, row, column, stride)
            rising &= _from(free, row, stride - column, stride)
    moves = np.zeros(points.shape, np.uint8)
    for bit, (rows, columns, leads) in enumerate(
        (
            (ALL, BUT_LAST, right),
            (BUT_LAST, ALL, down),
            (ALL, BUT_FIRST, right),
            (BUT_FIRST, ALL, down),
            (BUT_LAST, BUT_LAST, falling),
            (BUT_LAST, BUT_FIRST, rising),
            (BUT_FIRST, BUT_FIRST, falling),
            (BUT_FIRST, BUT_LAST, rising),
        )
    ):
        moves[rows, columns] |= leads.astype(np.uint8) << bit
    return moves


def _from(free: Array, row: int, column: int, stride: int) -> Array:
    """Every `stride`-th cell from (row, column) in 0..stride, as many as there are squares between points."""
    return free[row : free.shape[0] - stride + row : stride, column : free.shape[1] - stride + column : stride]
