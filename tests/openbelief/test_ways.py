"""Ways to some cells, and floor with room for them: the same as over the whole grid, at the cost of a part of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from openbelief import walkable as tiles
from openbelief.traversability import OCCUPIED, UNKNOWN, OccupancyGrid, reach
from openbelief.walkable import Walkable
from openbelief.ways import ways

RADIUS_M = 0.12


def cluttered(rng: np.random.Generator, height: int, width: int) -> OccupancyGrid:
    """Walls with gaps, boxes, costs, margins and unknown floor."""
    cells = np.zeros((height, width), np.int8)
    for _ in range(int(rng.integers(0, 8))):
        row, column, value = (
            rng.integers(height),
            rng.integers(width),
            rng.choice([OCCUPIED, OCCUPIED, 60, 99, UNKNOWN]),
        )
        cells[row : row + rng.integers(1, 30), column : column + rng.integers(1, 30)] = value
    for _ in range(int(rng.integers(0, 4))):
        row, gap = rng.integers(height), rng.integers(width)
        cells[row] = OCCUPIED
        cells[row, gap : gap + rng.integers(0, 9)] = 0
    return OccupancyGrid(cells, 0.05, (-3.0, 1.0))


@given(st.integers(0, 2**32 - 1), st.integers(2, 70), st.integers(2, 70), st.sampled_from([5, 16, 128]))
@settings(max_examples=80, deadline=None)
def test_floor_worked_out_in_tiles_is_the_inflated_grids(seed, height, width, tile):
    rng = np.random.default_rng(seed)
    grid = cluttered(rng, height, width)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tiles, "TILE", tile)
        floor = Walkable(grid, RADIUS_M)
        cells = rng.integers(0, [height, width], (20, 2))
        free = grid.inflated(RADIUS_M).free
        np.testing.assert_array_equal(floor.free(floor.flat(cells)), free[tuple(cells.T)])
        everywhere = np.argwhere(np.ones(grid.cells.shape))
        np.testing.assert_array_equal(floor.free(floor.flat(everywhere)), free.ravel())


@given(st.integers(0, 2**32 - 1), st.integers(20, 90), st.integers(20, 90))
@settings(max_examples=120, deadline=None)
def test_ways_are_to_the_bit_those_of_a_search_over_the_whole_grid(seed, height, width):
    rng = np.random.default_rng(seed)
    grid = cluttered(rng, height, width)
    inflated = grid.inflated(RADIUS_M)
    free = np.argwhere(inflated.free)
    if not len(free):
        return
    start = free[rng.integers(len(free))]
    centre = rng.integers(0, [height, width])
    targets = free[np.abs(free - centre).max(axis=1) < 12]
    if not len(targets):
        return
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("openbelief.ways.DETOUR_CELLS", int(rng.integers(1, 80)))
        patch.setattr("openbelief.ways.LEAST_FLOOD", int(rng.integers(1, 500)))
        lengths = ways(Walkable(grid, RADIUS_M), start, targets)
    whole = reach(inflated, grid.centre(start)).distance_m[tuple(targets.T)]
    np.testing.assert_array_equal(lengths * grid.resolution_m, whole)


def test_a_target_shut_in_ends_the_search_before_the_site_does():
    cells = np.zeros((4000, 4000), np.int8)
    cells[1990:2000, 1990:2030] = OCCUPIED  # a box of walls
    cells[2020:2030, 1990:2030] = OCCUPIED
    cells[1990:2030, 1990:2000] = OCCUPIED
    cells[1990:2030, 2020:2030] = OCCUPIED
    floor = Walkable(OccupancyGrid(cells, 0.05, (0.0, 0.0)), 0.0)
    lengths = ways(floor, np.array([2000, 1900]), np.array([[2010, 2010], [2010, 1985]]))
    assert lengths[0] == np.inf and lengths[1] == pytest.approx(85 + 10 * (np.sqrt(2) - 1))
    assert worked_out(floor) < 40 * tiles.TILE**2


def worked_out(floor: Walkable) -> int:
    return int(np.count_nonzero(floor._state))


@pytest.mark.parametrize("side", [400, 4000])
def test_a_short_way_costs_the_same_on_every_site(side: int):
    floor = Walkable(OccupancyGrid(np.zeros((side, side), np.int8), 0.05, (0.0, 0.0)), 0.35)
    assert ways(floor, np.array([200, 200]), np.array([[200, 300]])).tolist() == [100.0]
    assert worked_out(floor) <= 400**2


def test_where_the_robot_stands_is_no_way_at_all():
    floor = Walkable(OccupancyGrid(np.zeros((9, 9), np.int8), 0.05, (0.0, 0.0)), 0.0)
    assert ways(floor, np.array([4, 4]), np.array([[4, 4], [4, 5], [5, 5]])).tolist() == [0.0, 1.0, np.sqrt(2)]
