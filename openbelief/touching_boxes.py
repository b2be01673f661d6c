"""Which axis-aligned boxes touch: those of like size that lie together are bundled, and all bundles are compared."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array

BUNDLE = 32  # n / 32 bundles are compared with each other, and then the boxes of those that touch
SMALLEST_M = 0.25  # boxes smaller than this are of one size


class TouchingBoxes:
    """For every box the others within `reach_m` of it along each axis.

    low, high: (n, 3) corners, map frame, metres. order: (n,) the boxes, neighbours in it mostly lie together.
    """

    def __init__(self, low: Array, high: Array, reach_m: float) -> None:
        self.order = _bundled(low.astype(np.float64), high.astype(np.float64))
        low, high = low[self.order].astype(np.float64), high[self.order].astype(np.float64) + reach_m
        starts = np.arange(0, len(low), BUNDLE)
        lows, highs = np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
        self._place = np.empty(len(low), np.int64)
        self._place[self.order] = np.arange(len(low))
        self._others: list[Array] = []  # of every bundle: the boxes that may touch one of its
        self._bits: list[Array] = []  # and of every box of it, which of them do; as bits, for all may touch all
        for bundle, start in enumerate(starts.tolist()):
            near = np.flatnonzero(_touch(lows[bundle], highs[bundle], lows, highs))
            self._compare(np.arange(start, min(start + BUNDLE, len(low))), near, low, high)

    def of(self, box: int) -> Array:
        """(k,) int32: the boxes that touch this one, without itself."""
        bundle, row = divmod(int(self._place[box]), BUNDLE)
        others = self._others[bundle]
        return others[np.unpackbits(self._bits[bundle][row], count=len(others)).view(bool)]

    def pairs(self) -> Array:
        """(m, 2) int64: i < j that touch, in lexicographic order."""
        found = [np.zeros((0, 2), np.int64)]
        for bundle, (others, bits) in enumerate(zip(self._others, self._bits, strict=True)):
            row, which = np.nonzero(np.unpackbits(bits, axis=1, count=len(others)))
            pairs = np.stack((self.order[bundle * BUNDLE + row], others[which]), axis=1)
            found.append(pairs[pairs[:, 0] < pairs[:, 1]])
        both = np.concatenate(found)
        return both[np.lexsort(both.T[::-1])]

    def _compare(self, rows: Array, bundles: Array, low: Array, high: Array) -> None:
        others = (bundles[:, None] * BUNDLE + np.arange(BUNDLE)).ravel()
        others = others[others < len(low)]
        touch = _touch(low[rows, None], high[rows, None], low[others], high[others])
        touch &= rows[:, None] != others
        self._others.append(self.order[others].astype(np.int32))
        self._bits.append(np.packbits(touch, axis=1))


def _touch(low: Array, high: Array, lows: Array, highs: Array) -> Array:
    """(..., m) bool. Corners (..., 3) and (m, 3); the high ones are grown by the reach already."""
    touch = low[..., 0] <= highs[:, 0]
    touch &= lows[:, 0] <= high[..., 0]
    for axis in (1, 2):
        touch &= low[..., axis] <= highs[:, axis]
        touch &= lows[:, axis] <= high[..., axis]
    return touch


def _bundled(low: Array, high: Array) -> Array:
    """(n,) order: by size in powers of two, then by place in tiles of about that size, so that a bundle is compact."""
    size_m = np.maximum((high - low).max(axis=1), SMALLEST_M)
    power = np.ceil(np.log2(size_m))
    tile = np.floor((low + high) / 2 / 2.0 ** (power + 1)[:, None])
    return np.lexsort((*tile.T[::-1], power))
