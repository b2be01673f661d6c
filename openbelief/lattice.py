"""Ways along a lattice: every so many cells of a window, joined where all cells between are free.

Each way on it is one of the floor, so its length is never too short; over open floor both are equally long. A search
over every fourth cell has a sixteenth of the work, and over every cell it is the whole search.
"""

from __future__ import annotations

from itertools import count

import numpy as np

from openbelief.arrays import Array
from openbelief.walkable import Walkable

STRAIGHT = [(0, 1), (1, 0), (0, -1), (-1, 0)]
DIAGONAL = [(1, 1), (1, -1), (-1, -1), (-1, 1)]  # number i lies between the straight ones i and i + 1
STEPS = np.array(STRAIGHT + DIAGONAL)
LENGTHS = np.hypot(STEPS[:, 0], STEPS[:, 1])[:, None]
BITS = (1 << np.arange(8, dtype=np.uint8))[:, None]
ALL, BUT_FIRST, BUT_LAST = slice(None), slice(1, None), slice(None, -1)
EACH = 16  # rounds: then what leads nowhere is left out


class Lattice:
    """lengths: of the ways found so far, in cells, over (rows + 2) x (columns + 2) points, the outer ones never walked.

    low, high: the window, row and column of the grid, which it covers at least; points lie at multiples of `stride`.
    """

    def __init__(self, walkable: Walkable, low: Array, high: Array, stride: int) -> None:
        self.stride = stride
        self._first = np.floor_divide(low, stride)
        self._shape = np.floor_divide(np.asarray(high) - 1, stride) - self._first + 2  # the last point may lie beyond
        moves = _moves(walkable.window(self._first * stride, (self._first + self._shape) * stride), stride)
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

    def start_from(self, other: Lattice) -> None:
        """Ways that another lattice found lead on from where they meet this one's window."""
        low = self._first * self.stride
        self.start(*other.points(low, low + self._shape * self.stride))

    def points(self, low: Array, high: Array) -> tuple[Array, Array]:
        """(k, 2) cells in a window of the points that ways lead to, and (k,) their lengths."""
        first = np.maximum(-np.floor_divide(-low, self.stride) - self._first, 0)
        last = np.maximum(-np.floor_divide(-high, self.stride) - self._first, first)
        lengths = self.lengths.reshape(-1, self._width)[1:-1, 1:-1][first[0] : last[0], first[1] : last[1]]
        reached = np.isfinite(lengths)
        return (np.argwhere(reached) + first + self._first) * self.stride, lengths[reached]

    def at(self, cells: Array) -> Array:
        """(m,) lengths of the ways to (m, 2) points in the window, inf where none was found."""
        found: Array = self.lengths[self._flat(cells // self.stride - self._first)]
        return found

    def walk(self, bound: float = np.inf, low: Array | None = None, high: Array | None = None) -> None:
        """All shortest ways from where they start; no farther than may lead into the box `low` to `high` by `bound`.

        Dijkstra's algorithm by fronts: no step is shorter than a stride, so of the points to walk on from all that are
        less than that behind the nearest have their shortest ways already, and each is walked on from once.
        """
        waiting, place = np.flatnonzero(np.isfinite(self.lengths)), np.zeros(len(self.lengths), np.int32)
        lengths, step = self.lengths, LENGTHS * self.stride
        for rounds in count():
            if low is not None and high is not None and rounds % EACH == 0:
                waiting = waiting[self._worthwhile(waiting, bound, low, high)]
            if not len(waiting):
                return
            far = lengths.take(waiting)
            now = far < far.min() + self.stride
            front = waiting[now]
            beside, longer = front + self._steps, far[now] + step
            better = np.flatnonzero((longer < lengths.take(beside)) & ((self._moves.take(front) & BITS) != 0))
            beside, longer = beside.take(better), longer.take(better)
            np.minimum.at(lengths, beside, longer)
            number = np.arange(len(beside), dtype=np.int32)
            place[beside] = number  # the last of those that are the same point stays
            waiting = np.concatenate((waiting[~now], beside[place.take(beside) == number]))

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
    """(h, w) uint8 of (stride h, stride w) free cells: the steps from each point, one bit for each of STEPS.

    Points are the first cells of squares. None of the last row and column leads on down or right.
    """
    phases = [[free[row::stride, column::stride].copy() for column in range(stride)] for row in range(stride)]
    high, wide = phases[0][0].shape

    def beyond(row: int, column: int, down: int, right: int) -> Array:
        """The cell so far from each point, of those that have another `down` rows and `right` columns after them."""
        i, j = row // stride, column // stride
        return phases[row % stride][column % stride][i : high - down + i, j : wide - right + j]

    right, down = beyond(0, 0, 0, 1).copy(), beyond(0, 0, 1, 0).copy()
    falling, rising = beyond(0, 0, 1, 1).copy(), beyond(0, stride, 1, 1).copy()
    for k in range(1, stride + 1):
        right &= beyond(0, k, 0, 1)
        down &= beyond(k, 0, 1, 0)
        for row, column in ((k, k - 1), (k - 1, k), (k, k)):  # a diagonal step needs both cells beside it
            falling &= beyond(row, column, 1, 1)
            rising &= beyond(row, stride - column, 1, 1)
    moves = np.zeros((high, wide), np.uint8)
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
        moves[rows, columns] |= leads.view(np.uint8) << bit
    return moves
