"""Walls and doorways of a planar grid whose walls run along its axes: furniture taken out, gaps closed.

A wall is what runs straight through occupied cells that no mapped object explains. A doorway is a gap of a door's width
whose side is the thin end of a wall.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.traversability import OCCUPIED, UNKNOWN

WALL_RUN_M = 0.5  # a shorter straight run of cells is furniture's
CRACK_M, BRIDGE_M = 0.2, 3.0  # gaps within a run; and between runs, where furniture hides the wall
STUB_M = 0.25  # what sticks out of a wall and is thinner may be a door's jamb
DOOR_MIN_M, DOOR_MAX_M, CORNER_DOOR_MAX_M = 0.5, 1.6, 1.3  # between two thin ends; beside a corner
JAMB_M, JAMB_THICK_M = 0.15, 0.3  # a thin end: so long, and no thicker
POCKET_M2 = 4.0  # an enclosed hole that is smaller is the inside of furniture

Turned: TypeAlias = Callable[[Array], Array]  # an image, or its transpose


@dataclass(frozen=True)
class WallMap:
    """(h, w) bool each: walls, the doorways between them, and what is neither but known (floor, or furniture on it)."""

    walls: Array
    doors: Array
    floor: Array


def wall_map(cells: Array, objects: Array, resolution_m: float) -> WallMap:
    """cells: (h, w) int8 of an OccupancyGrid. objects: (h, w) bool, the cells under mapped objects."""
    lines = _Lines(resolution_m)
    known, solid = cells != UNKNOWN, _filled(cells >= OCCUPIED, resolution_m)
    unexplained = solid & ~cv2.dilate(objects.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    walls = lines.both(lambda turn: _straight(turn(unexplained), turn(solid), lines))
    walls |= lines.both(lambda turn: _stubs(turn(unexplained), turn(walls), lines))
    doors = lines.both(lambda turn: _gaps(turn(walls), turn(solid), lines))
    return WallMap(walls, doors, known & ~walls & ~doors)


class _Lines:
    """Work along rows; `both` does the same along columns and joins the two."""

    def __init__(self, resolution_m: float) -> None:
        self._resolution_m = resolution_m

    def cells(self, metres: float) -> int:
        return max(1, round(metres / self._resolution_m))

    def both(self, work: Callable[[Turned], Array]) -> Array:
        return work(lambda image: image) | work(lambda image: image.T).T

    def closed(self, image: Array, metres: float) -> Array:
        return self._morph(cv2.MORPH_CLOSE, image, metres)

    def opened(self, image: Array, metres: float) -> Array:
        return self._morph(cv2.MORPH_OPEN, image, metres)

    def _morph(self, operation: int, image: Array, metres: float) -> Array:
        n = self.cells(metres)
        wide = np.pad(image.astype(np.uint8), ((0, 0), (n, n)))
        return cv2.morphologyEx(wide, operation, np.ones((1, n), np.uint8))[:, n:-n].astype(bool)


def _filled(occupied: Array, resolution_m: float) -> Array:
    """With the small enclosed holes: a lidar sees only the outline of a wardrobe."""
    _, holes, stats, _ = cv2.connectedComponentsWithStats((~occupied).astype(np.uint8), connectivity=4)
    small = stats[:, cv2.CC_STAT_AREA] * resolution_m**2 < POCKET_M2
    small[0] = False  # that is what is occupied
    return occupied | small[holes]


def _straight(unexplained: Array, solid: Array, lines: _Lines) -> Array:
    """Runs along rows that no object explains, and the solid cells in line with them that furniture hides."""
    seen = lines.opened(lines.closed(unexplained, CRACK_M), WALL_RUN_M)
    across = lines.opened(lines.closed(unexplained.T, CRACK_M), WALL_RUN_M).T
    bridged = _runs_with(lines.closed(seen | across, BRIDGE_M), seen)  # to the next piece, or to the wall in the corner
    return solid & (bridged | _runs_with(lines.closed(solid, CRACK_M / 2), seen))


def _stubs(unexplained: Array, walls: Array, lines: _Lines) -> Array:
    """Thin pieces along rows that go on from a wall."""
    thin = unexplained & (lines.cells(STUB_M) >= run_lengths(unexplained.T).T)
    return thin & _runs_with(thin | walls, walls)


def _gaps(walls: Array, solid: Array, lines: _Lines) -> Array:
    """Doorways along rows: between two thin ends of walls, or between one and whatever wall is opposite."""
    gaps = np.zeros(walls.shape, bool)
    thin = walls & (lines.cells(JAMB_THICK_M) >= run_lengths((walls | solid).T).T)
    thin &= run_lengths(walls) >= lines.cells(2 * JAMB_M)
    jamb = lines.cells(JAMB_M)
    widest, beside_corner = lines.cells(DOOR_MAX_M), lines.cells(CORNER_DOOR_MAX_M)
    for row, start, end in zip(*_runs(~walls), strict=True):
        width = end - start
        inside = start > 0 and end < walls.shape[1]
        if not inside or not lines.cells(DOOR_MIN_M) <= width <= widest:
            continue
        ends = thin[row, max(0, start - jamb) : start].all(), thin[row, end : end + jamb].all()
        if all(ends) or (any(ends) and width <= beside_corner):
            gaps[row, start:end] = True
    return _thin_across(gaps, lines.cells(JAMB_THICK_M) + 1)


def _thin_across(gaps: Array, most: int) -> Array:
    """Without gaps that are deeper than a wall is thick."""
    _, pieces, stats, _ = cv2.connectedComponentsWithStats(gaps.astype(np.uint8), connectivity=4)
    return gaps & (stats[:, cv2.CC_STAT_HEIGHT] <= most)[pieces]


def _runs(image: Array) -> tuple[Array, Array, Array]:
    """(row, start, end) of every run of True along a row."""
    change = np.diff(np.pad(image.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    row, start = np.nonzero(change == 1)
    return row, start, np.nonzero(change == -1)[1]


def run_lengths(image: Array) -> Array:
    """(h, w) int: how long the run along its row is that a True cell lies in, 0 elsewhere."""
    _, start, end = _runs(image)
    return _spread(image, end - start)


def _runs_with(image: Array, marked: Array) -> Array:
    """The runs along rows that hold a marked cell."""
    runs = _spread(image, np.arange(1, len(_runs(image)[0]) + 1))
    return np.isin(runs, np.unique(runs[marked & image])) & image


def _spread(image: Array, values: Array) -> Array:
    """(h, w) int: each run's value in its cells."""
    _, start, end = _runs(image)
    spread = np.zeros(image.shape, np.int64)
    spread[image] = np.repeat(values, end - start)
    return spread
