"""Ways to some cells, and floor with room for them: the same as over the whole grid, at the cost of a part of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import binary_erosion, label

from openbelief import walkable as tiles
from openbelief.floor_parts import FloorParts
from openbelief.lattice import Lattice
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
        low = rng.integers(-9, [height, width])
        size = rng.integers(0, 90, 2)
        around = np.pad(free, 120)
        part = around[low[0] + 120 :, low[1] + 120 :][: size[0], : size[1]]
        np.testing.assert_array_equal(Walkable(grid, RADIUS_M).window(low, low + size), part)


def asked(seed: int, height: int, width: int) -> tuple[OccupancyGrid, np.ndarray, np.ndarray, np.ndarray] | None:
    """A grid, a free cell to start from, free cells near each other, and metres to these by the whole grid."""
    rng = np.random.default_rng(seed)
    grid = cluttered(rng, height, width)
    inflated = grid.inflated(RADIUS_M)
    free = np.argwhere(inflated.free)
    if not len(free):
        return None
    start, centre = free[rng.integers(len(free))], rng.integers(0, [height, width])
    targets = free[np.abs(free - centre).max(axis=1) < 12]
    if not len(targets):
        return None
    return grid, start, targets, reach(inflated, grid.centre(start)).distance_m[tuple(targets.T)]


@contextmanager
def looking(seed: int, **more: int) -> Iterator[None]:
    """With small tiles and small first guesses, so that small grids are as large ones."""
    rng = np.random.default_rng(seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("openbelief.ways.DETOUR_CELLS", int(rng.integers(1, 80)))
        patch.setattr("openbelief.ways.AROUND", int(rng.integers(4, 24)))
        patch.setattr("openbelief.floor_parts.SIDE", int(rng.integers(3, 60)))
        for name, value in more.items():
            patch.setattr(f"openbelief.ways.{name}", value)
        yield


@given(st.integers(0, 2**32 - 1), st.integers(20, 90), st.integers(20, 90))
@settings(max_examples=120, deadline=None)
def test_ways_are_to_the_bit_those_of_a_search_over_the_whole_grid(seed, height, width):
    if (case := asked(seed, height, width)) is None:
        return
    grid, start, targets, whole_m = case
    with looking(seed):
        lengths = ways(Walkable(grid, RADIUS_M), start, targets)
    np.testing.assert_array_equal(lengths * grid.resolution_m, whole_m)


@given(st.integers(0, 2**32 - 1), st.integers(60, 220), st.integers(60, 220))
@settings(max_examples=60, deadline=None)
def test_long_ways_lead_wherever_one_does_and_where_there_is_room_are_hardly_longer(seed, height, width):
    if (case := asked(seed, height, width)) is None:
        return
    grid, start, targets, whole_m = case
    with looking(seed, EXACT=-1):
        lengths = ways(Walkable(grid, RADIUS_M), start, targets)
    exact, there = whole_m / grid.resolution_m, np.isfinite(whole_m)
    np.testing.assert_array_equal(np.isfinite(lengths), there)
    assert (lengths[there] >= exact[there] - 1e-6).all()
    wide = binary_erosion(grid.inflated(RADIUS_M).free, np.ones((9, 9)))
    if wide[tuple(start)]:
        roomy = OccupancyGrid(np.where(wide, 0, OCCUPIED).astype(np.int8), 0.05, grid.origin_xy)
        longest = reach(roomy, roomy.centre(start)).distance_m[tuple(targets.T)] / 0.05
        assert (lengths <= 1.1 * longest + 24).all()


@given(st.integers(0, 2**32 - 1), st.integers(4, 70), st.integers(4, 70), st.integers(2, 40))
@settings(max_examples=80, deadline=None)
def test_floor_is_joined_where_a_robot_can_walk_and_only_there(seed, height, width, side):
    rng = np.random.default_rng(seed)
    grid = cluttered(rng, height, width)
    free = np.argwhere(grid.inflated(RADIUS_M).free)
    if not len(free):
        return
    start, others = free[rng.integers(len(free))], free[rng.integers(0, len(free), 12)]
    number, _ = label(grid.inflated(RADIUS_M).free)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("openbelief.floor_parts.SIDE", side)
        tiles = FloorParts(Walkable(grid, RADIUS_M)).tiles_between(start, others)
    assert np.isfinite(tiles).tolist() == (number[tuple(others.T)] == number[tuple(start)]).tolist()


@given(st.integers(0, 2**32 - 1), st.integers(10, 60), st.integers(10, 60), st.sampled_from([1, 2, 4]))
@settings(max_examples=80, deadline=None)
def test_ways_along_a_lattice_are_those_of_its_graph(seed, height, width, stride):
    rng = np.random.default_rng(seed)
    grid = cluttered(rng, height, width)
    free = grid.inflated(RADIUS_M).free
    points = np.argwhere(free[::stride, ::stride]) * stride
    if not len(points):
        return
    start = points[rng.integers(len(points))]
    lattice = Lattice(Walkable(grid, RADIUS_M), np.zeros(2, int), np.array(grid.cells.shape), stride)
    lattice.start(start[None], np.zeros(1))
    lattice.walk()
    np.testing.assert_allclose(lattice.at(points), by_hand(free, points, start, stride), atol=1e-4)


def by_hand(free: np.ndarray, points: np.ndarray, start: np.ndarray, stride: int) -> np.ndarray:
    """Bellman and Ford over every pair of neighbours that are joined cell by cell."""
    lengths = {tuple(p): np.inf for p in points.tolist()}
    lengths[tuple(start.tolist())] = 0.0
    steps = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b]

    def joined(at: tuple[int, int], step: tuple[int, int]) -> bool:
        cells = [(at[0] + step[0] * k, at[1] + step[1] * k) for k in range(stride + 1)]
        if all(step):
            cells += [(at[0] + step[0] * (k + 1), at[1] + step[1] * k) for k in range(stride)]
            cells += [(at[0] + step[0] * k, at[1] + step[1] * (k + 1)) for k in range(stride)]
        return all(0 <= r < free.shape[0] and 0 <= c < free.shape[1] and free[r, c] for r, c in cells)

    edges = [
        (at, to, stride * float(np.hypot(*step)))
        for at in lengths
        for step in steps
        if (to := (at[0] + step[0] * stride, at[1] + step[1] * stride)) in lengths and joined(at, step)
    ]
    changed = True
    while changed:
        changed = False
        for at, to, length in edges:
            if lengths[at] + length < lengths[to] - 1e-9:
                lengths[to], changed = lengths[at] + length, True
    return np.array([lengths[tuple(p)] for p in points.tolist()])


def test_a_target_shut_in_ends_the_search_before_the_site_does():
    cells = np.zeros((4000, 4000), np.int8)
    cells[1990:2000, 1990:2030] = OCCUPIED  # a box of walls
    cells[2020:2030, 1990:2030] = OCCUPIED
    cells[1990:2030, 1990:2000] = OCCUPIED
    cells[1990:2030, 2020:2030] = OCCUPIED
    floor = Walkable(OccupancyGrid(cells, 0.05, (0.0, 0.0)), 0.0)
    lengths = ways(floor, np.array([2000, 1900]), np.array([[2010, 2010], [2010, 1985]]))
    assert lengths[0] == np.inf and lengths[1] == pytest.approx(85 + 10 * (np.sqrt(2) - 1))
    assert worked_out(floor) <= 1024**2


def test_a_way_round_a_wall_as_long_as_the_site_is_found_and_is_a_way():
    cells = np.zeros((1200, 1200), np.int8)
    cells[:1150, 600] = OCCUPIED
    grid = OccupancyGrid(cells, 0.05, (0.0, 0.0))
    start, target = np.array([100, 580]), np.array([100, 620])
    length = ways(Walkable(grid, 0.1), start, target[None])[0]
    exact = reach(grid.inflated(0.1), grid.centre(start)).distance_m[tuple(target)] / 0.05
    assert exact > 2000 and length == pytest.approx(exact, abs=1e-6)


def test_a_gap_of_one_cell_between_far_rooms_is_found():
    cells = np.zeros((1300, 400), np.int8)
    cells[::100] = OCCUPIED
    cells[::100, 201] = 0  # where no lattice of every other cell leads through
    start, target = np.array([50, 50]), np.array([1250, 350])
    grid = OccupancyGrid(cells, 0.05, (0.0, 0.0))
    with looking(0, EXACT=-1):
        length = ways(Walkable(grid, 0.0), start, target[None])[0]
    exact = reach(grid, grid.centre(start)).distance_m[tuple(target)] / 0.05
    assert exact <= length <= 1.01 * exact


def worked_out(floor: Walkable) -> int:
    return int(np.count_nonzero(floor._state))


@pytest.mark.parametrize("side", [700, 4000])
def test_a_short_way_costs_the_same_on_every_site(side: int):
    floor = Walkable(OccupancyGrid(np.zeros((side, side), np.int8), 0.05, (0.0, 0.0)), 0.35)
    assert ways(floor, np.array([200, 200]), np.array([[200, 300]])).tolist() == [100.0]
    assert worked_out(floor) <= 600**2


def test_where_the_robot_stands_is_no_way_at_all():
    floor = Walkable(OccupancyGrid(np.zeros((9, 9), np.int8), 0.05, (0.0, 0.0)), 0.0)
    assert ways(floor, np.array([4, 4]), np.array([[4, 4], [4, 5], [5, 5]])).tolist() == [0.0, 1.0, np.sqrt(2)]
