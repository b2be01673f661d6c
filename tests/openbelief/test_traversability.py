"""The planar grid: cells, margins, ways."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief.polyline import path_length
from openbelief.traversability import (
    FREE,
    INSCRIBED,
    OCCUPIED,
    UNKNOWN,
    NoPath,
    OccupancyGrid,
    path,
    reach,
)


def grid_of(*rows: str, resolution: float = 0.5, origin: tuple[float, float] = (-1.0, 2.0)) -> OccupancyGrid:
    """'.' free, '#' occupied, '+' margin, '?' unknown; the first row is the highest y, as on paper."""
    values = {".": FREE, "#": OCCUPIED, "+": INSCRIBED, "?": UNKNOWN}
    return OccupancyGrid(np.array([[values[c] for c in row] for row in rows[::-1]], np.int8), resolution, origin)


def test_cell_and_centre_are_inverse_and_row_is_y() -> None:
    grid = grid_of("....", "...#")
    assert grid.cell(np.array([0.6, 2.1])).tolist() == [0, 3]
    assert grid.at(np.array([[0.6, 2.1], [0.6, 2.6], [9.0, 2.0]])).tolist() == [OCCUPIED, FREE, UNKNOWN]
    cells = np.argwhere(np.ones((2, 4)))
    assert grid.cell(grid.centre(cells)).tolist() == cells.tolist()


def test_unknown_and_nav2_margin_are_not_free_but_cost_is() -> None:
    grid = OccupancyGrid(np.array([[0, 50, 98, 99, 100, -1]], np.int8), 0.05, (0.0, 0.0))
    assert grid.free.tolist() == [[True, True, True, False, False, False]]


def test_inflation_marks_exactly_the_cells_within_the_radius() -> None:
    cells = np.zeros((21, 21), np.int8)
    cells[10, 10] = OCCUPIED
    cells[0, 0] = UNKNOWN
    grown = OccupancyGrid(cells, 0.05, (0.0, 0.0)).inflated(0.2)
    away = np.hypot(*(np.indices((21, 21)) - 10)) * 0.05
    np.testing.assert_array_equal(grown.cells == INSCRIBED, (away <= 0.2 + 1e-9) & (away > 0))
    assert grown.cells[10, 10] == OCCUPIED and grown.cells[0, 0] == UNKNOWN


def test_a_path_goes_round_the_wall_from_the_exact_start_to_the_exact_goal() -> None:
    grid = grid_of(".....", ".###.", "...#.", ".###.", ".....", resolution=1.0, origin=(0.0, 0.0))
    way = path(grid, np.array([2.6, 2.4]), np.array([4.5, 2.5]))
    assert way[0].tolist() == [2.6, 2.4] and way[-1].tolist() == [4.5, 2.5]
    assert (grid.at(way) == FREE).all()
    assert path_length(way) == pytest.approx(10, abs=0.2)  # no corner is cut: every turn is a right angle


def test_a_diagonal_gap_between_two_obstacles_is_no_passage() -> None:
    grid = grid_of(".#", "#.", resolution=1.0, origin=(0.0, 0.0))
    with pytest.raises(NoPath, match="no way over known free floor"):
        path(grid, np.array([0.5, 1.5]), np.array([1.5, 0.5]))


def test_unknown_floor_is_no_way() -> None:
    grid = grid_of("..?..", resolution=1.0, origin=(0.0, 0.0))
    with pytest.raises(NoPath, match="no way"):
        path(grid, np.array([0.5, 0.5]), np.array([4.5, 0.5]))


def test_a_goal_that_is_not_free_or_off_the_map_is_refused_by_name() -> None:
    grid = grid_of("..+", resolution=1.0, origin=(0.0, 0.0))
    for goal in ([2.5, 0.5], [7.0, 0.5]):
        with pytest.raises(NoPath, match="not free"):
            path(grid, np.array([0.5, 0.5]), np.array(goal))


def test_a_robot_inside_a_margin_steps_out_to_its_own_side_of_the_wall() -> None:
    grid = grid_of("......++#....", "......++#....", resolution=0.1, origin=(0.0, 0.0))
    way = path(grid, np.array([0.75, 0.05]), np.array([0.05, 0.05]))
    assert way[0].tolist() == [0.75, 0.05] and (np.diff(way[:, 0]) < 0).all()
    with pytest.raises(NoPath):
        path(grid, np.array([0.75, 0.05]), np.array([1.15, 0.05]))  # nearer as the crow flies, but behind the wall


def test_a_robot_marked_as_an_obstacle_by_its_own_body_can_still_leave() -> None:
    grid = grid_of("...#...", resolution=0.1, origin=(0.0, 0.0))
    assert len(path(grid, np.array([0.35, 0.05]), np.array([0.05, 0.05]))) == 4


def test_a_robot_shut_in_or_off_the_map_is_told_so() -> None:
    with pytest.raises(NoPath, match="not on free floor"):
        reach(grid_of("?????", resolution=1.0), np.array([0.0, 2.5]))
    with pytest.raises(NoPath, match="outside the map"):
        reach(grid_of("..."), np.array([50.0, 0.0]))


def test_distances_on_an_open_floor_are_octile() -> None:
    grid = OccupancyGrid(np.zeros((40, 60), np.int8), 0.05, (0.0, 0.0))
    distance = reach(grid, grid.centre(np.array([5, 7]))).distance_m
    rows, columns = np.abs(np.indices((40, 60)) - np.array([5, 7])[:, None, None])
    octile = np.maximum(rows, columns) + (np.sqrt(2) - 1) * np.minimum(rows, columns)
    np.testing.assert_allclose(distance, octile * 0.05, atol=1e-9)


def test_a_way_across_a_large_map_goes_round_its_walls() -> None:
    cells = np.zeros((400, 400), np.int8)
    cells[::20, 10:-10] = OCCUPIED
    grid = OccupancyGrid(cells, 0.05, (0.0, 0.0)).inflated(0.2)
    way = path(grid, np.array([10.0, 0.5]), np.array([10.0, 19.5]))
    assert (grid.at(way) < INSCRIBED).all() and np.linalg.norm(np.diff(way, axis=0), axis=1).sum() > 20.0
