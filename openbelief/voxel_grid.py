"""Occupied cells and what lies in steps around them: each is one number of a grid with room for every step."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from openbelief.arrays import Array

DIRECT_CELLS = 1 << 26  # a grid of so many is looked into directly; of its row of zeros only what is touched is memory
KEPT_CELLS = 1 << 21  # of a row that is kept: enough for a thing of 2 m, or a wall along the axes of the map
LOOKS = 1 << 13  # at once: what passes through stays in the processor's cache


class Grid:
    """Room for (3, k) cells, numbered from 0 along each axis, and for (b, 3) steps from any of them, in one row."""

    def __init__(self, cells: Array, steps: Array) -> None:
        self._margin = int(np.abs(steps).max())
        sides = [int(most) + 1 + 2 * self._margin for most in cells.max(axis=1)]
        self.length = sides[0] * sides[1] * sides[2]
        if self.length >= 1 << 63:
            raise ValueError("voxel_m is too small for things of its size")
        self._strides = np.array([sides[1] * sides[2], sides[2], 1])

    def flat(self, cells: Array) -> Array:
        """(k,) int64 places of (3, k) cells in the row; ascending where they are in lexicographic order."""
        places = np.full(cells.shape[1], self._margin * self._strides.sum())
        for axis, stride in zip(cells, self._strides, strict=True):
            places += axis * stride
        return places

    def flat_steps(self, steps: Array) -> Array:
        """(b,) int64: how far (b, 3) steps lead along the row."""
        return steps @ self._strides


class Table:
    """A whole number for each of (k,) ascending places in a row of zeros."""

    def __init__(self, places: Array, row: Array) -> None:
        self._places, self._row = places, row

    def fill(self, numbers: Array) -> None:
        """numbers: (k,), one for each place."""
        self._row[self._places] = numbers

    def around(self, chosen: Array | slice, steps: Array) -> Iterator[Array]:
        """(b', k') int32, in turn: what lies some of (b,) steps from the chosen places."""
        places = self._places[chosen]
        at_once = max(1, LOOKS // max(len(places), 1))
        for first in range(0, len(steps), at_once):
            yield self.at(steps[first : first + at_once, None] + places)

    def at(self, places: Array) -> Array:
        """int32, of the shape of `places`: what lies there, 0 where nothing does."""
        return self._row.take(places)


class _Sparse(Table):
    """Of a row that is too long to be kept: the places are searched."""

    def __init__(self, places: Array) -> None:
        super().__init__(places, np.zeros(len(places), np.int32))

    def fill(self, numbers: Array) -> None:
        self._row[:] = numbers

    def at(self, places: Array) -> Array:
        nearest = np.minimum(np.searchsorted(self._places, places), len(self._places) - 1)
        return np.where(self._places[nearest] == places, self._row[nearest], 0)


class _Rows(threading.local):
    """Rows of zeros that a thread keeps: fresh memory costs more than what is done in it."""

    def __init__(self) -> None:
        self.free: list[Array] = []


_ROWS = _Rows()


@contextmanager
def table(grid: Grid, places: Array) -> Iterator[Table]:
    """A table for (k,) ascending places of the grid, as long as the context lasts."""
    if grid.length > DIRECT_CELLS:
        yield _Sparse(places)
        return
    row = _ROWS.free.pop() if _ROWS.free else np.zeros(KEPT_CELLS, np.int32)
    if len(row) < grid.length:
        _ROWS.free.append(row)
        row = np.zeros(grid.length, np.int32)
    yield Table(places, row)
    if len(row) == KEPT_CELLS:  # after an error it is not all zeros, and not kept
        row[places] = 0
        _ROWS.free.append(row)
