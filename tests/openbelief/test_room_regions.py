from __future__ import annotations

import numpy as np
import pytest

from openbelief.polygon import inside
from openbelief.room_regions import room_regions, wall_angle_deg
from openbelief.traversability import OccupancyGrid
from openbelief.wall_map import run_lengths, wall_map
from tests.support.flats import flat

SEEDS = range(300, 316)  # none of them was looked at while the method was made


def two_rooms(door=(1.0, 2.0), wall=0.1):
    """4 x 3 m and 3 x 3 m beside each other, a door in the wall between them; 5 cm cells, everything known."""
    cells = np.zeros((64, 146), np.int8)
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = 100, 100, 100, 100
    middle = 82
    cells[:, middle : middle + round(wall / 0.05)] = 100
    if door:
        cells[round(door[0] / 0.05) : round(door[1] / 0.05), middle : middle + round(wall / 0.05)] = 0
    return OccupancyGrid(cells, 0.05, (0.0, 0.0))


def test_a_door_divides_two_rooms():
    regions = room_regions(two_rooms(), [])
    assert regions.count == 2
    assert regions.labels[30, 40] != regions.labels[30, 120]


def test_a_table_in_the_way_divides_nothing_once_it_is_mapped():
    grid = two_rooms()
    grid.cells[20:44, 30:34] = 100  # across the middle of the larger room
    x, y = np.meshgrid(np.arange(1.5, 1.7, 0.02), np.arange(1.0, 2.2, 0.02))
    table = np.column_stack((x.ravel(), y.ravel(), np.full(x.size, 0.6)))
    assert room_regions(grid, [table]).count == 2


def test_a_wall_that_furniture_hides_on_both_sides_stays_a_wall():
    grid = two_rooms()
    grid.cells[40:60, 70:96] = 100  # shelves on both sides of the wall, mapped as one thing through it
    x, y = np.meshgrid(np.arange(3.5, 4.8, 0.02), np.arange(2.0, 3.0, 0.02))
    shelves = np.column_stack((x.ravel(), y.ravel(), np.full(x.size, 0.6)))
    assert room_regions(grid, [shelves]).count == 2


def test_a_narrow_corridor_is_a_room_of_its_own():
    cells = np.zeros((100, 160), np.int8)
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = 100, 100, 100, 100
    cells[38:40], cells[58:60] = 100, 100  # 0.9 m between them
    cells[38:40, 20:38], cells[58:60, 110:128] = 0, 0  # doors as wide as the corridor
    assert room_regions(OccupancyGrid(cells, 0.05, (0.0, 0.0)), []).count == 3


def test_an_outline_holds_its_region_and_no_other():
    grid = two_rooms()
    regions = room_regions(grid, [])
    left, right = (regions.labels[tuple(grid.cell(np.array([x, 1.5])))] for x in (2.0, 5.5))
    for x, y, owner in ((2.0, 1.5, left), (5.5, 1.5, right), (2.0, 2.9, left)):
        holding = [k for k in (1, 2) if inside(np.array([x, y]), regions.polygon(k, grid))[0]]
        assert holding == [owner]


def test_a_grid_without_floor_has_no_rooms():
    for value in (-1, 100):
        assert room_regions(OccupancyGrid(np.full((20, 30), value, np.int8), 0.05, (0.0, 0.0)), []).count == 0


@pytest.mark.parametrize("angle", [0, 12, -31, 44])
def test_the_walls_angle_is_found(angle):
    turned = flat(302).turned(np.deg2rad(angle))
    off = (wall_angle_deg(turned.grid.cells >= 100) - angle + 45) % 90 - 45  # walls are the same after a quarter turn
    assert abs(off) <= 1.0


@pytest.mark.parametrize("angle", [0, 20])
def test_furniture_of_drawn_flats_is_found_in_its_rooms(angle):
    shares = []
    for seed in SEEDS:
        drawn = flat(seed).turned(np.deg2rad(angle)) if angle else flat(seed)
        shares.append(drawn.share_in_right_room(room_regions(drawn.grid, drawn.clouds).labels))
    assert np.mean(shares) >= 0.9, np.round(shares, 2)


def test_the_same_grid_gives_the_same_rooms():
    drawn = flat(303)
    one, other = (room_regions(drawn.grid, drawn.clouds) for _ in range(2))
    assert (one.labels == other.labels).all()


def test_runs_are_measured_along_rows():
    image = np.array([[1, 1, 0, 1], [0, 0, 0, 0], [1, 1, 1, 1]], bool)
    assert run_lengths(image).tolist() == [[2, 2, 0, 1], [0, 0, 0, 0], [4, 4, 4, 4]]


def test_doorways_are_gaps_of_a_doors_width():
    for width, found in ((0.8, True), (1.2, True), (0.3, False), (2.2, False)):
        grid = two_rooms(door=(0.9, 0.9 + width))
        walls = wall_map(grid.cells, np.zeros(grid.cells.shape, bool), 0.05)
        assert walls.doors[:, 82].any() == found, width
