"""A grid from points: floor, obstacles, and what nobody saw."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import binary_closing

from openbelief import occupancy
from openbelief.occupancy import floor_height, from_points
from openbelief.traversability import FREE, OCCUPIED, UNKNOWN


def sheet(x: tuple[float, float], y: tuple[float, float], z: float, step: float = 0.02) -> np.ndarray:
    grid = np.meshgrid(np.arange(*x, step) + 0.01, np.arange(*y, step) + 0.01)
    return np.stack((*grid, np.full_like(grid[0], z)), axis=-1).reshape(-1, 3)


def wall(x: float, y: tuple[float, float], z: tuple[float, float]) -> np.ndarray:
    return sheet(y, z, x)[:, [2, 0, 1]]


FLOOR = sheet((0.0, 2.0), (0.0, 2.0), 0.0)


def test_floor_is_free_an_obstacle_is_occupied_and_the_unseen_is_unknown() -> None:
    grid = from_points(np.concatenate((FLOOR, wall(1.02, (0.0, 1.0), (0.0, 2.5)), sheet((3.0, 3.2), (0.0, 0.2), 0.0))))
    assert grid.at(np.array([0.5, 0.5])) == FREE
    assert grid.at(np.array([1.02, 0.5])) == OCCUPIED
    assert grid.at(np.array([1.02, 1.5])) == FREE
    assert grid.at(np.array([2.5, 0.1])) == UNKNOWN
    assert grid.heights_m is not None and grid.heights_m[tuple(grid.cell(np.array([1.02, 0.5])))] > 1.4


@pytest.mark.parametrize(
    ("low", "high", "value"), [(0.0, 0.15, FREE), (0.0, 0.4, OCCUPIED), (1.2, 1.8, OCCUPIED), (1.7, 2.4, FREE)]
)
def test_only_what_a_robot_would_run_into_is_an_obstacle(low: float, high: float, value: int) -> None:
    grid = from_points(np.concatenate((FLOOR, wall(1.02, (0.0, 1.0), (low, high)))))
    assert grid.at(np.array([1.02, 0.5])) == value


def test_one_stray_return_is_no_obstacle() -> None:
    assert from_points(np.concatenate((FLOOR, [[1.0, 1.0, 0.8]]))).at(np.array([1.0, 1.0])) == FREE


def test_the_floor_is_found_wherever_the_map_puts_it_and_under_reflections() -> None:
    rng = np.random.default_rng(0)
    reflections = rng.uniform([0, 0, -3.0], [2, 2, -1.0], (50, 3))
    noisy = FLOOR + rng.normal(0, 0.01, FLOOR.shape) + [0, 0, 0.7]
    desk, ceiling = sheet((0.0, 1.0), (0.0, 1.0), 1.4), sheet((0.0, 2.0), (0.0, 2.0), 3.2)
    points = np.concatenate((noisy, reflections, desk, ceiling))
    assert floor_height(points) == pytest.approx(0.7, abs=0.01)
    assert from_points(points).at(np.array([1.5, 1.5])) == FREE


def test_points_that_cannot_be_one_site_are_refused() -> None:
    with pytest.raises(ValueError, match="span"):
        from_points(np.concatenate((FLOOR, [[1e5, 0.0, 0.0]])))
    with pytest.raises(ValueError, match="finite"):
        from_points(np.concatenate((FLOOR, [[np.nan, 0.0, 0.0]])))


@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.integers(1, 9), st.floats(0, 1))
@settings(max_examples=100, deadline=None)
def test_gaps_are_closed_as_the_textbook_has_it_up_to_the_grids_edge(seed: int, h: int, w: int, share: float) -> None:
    floor = np.random.default_rng(seed).random((h, w)) < share
    closed = binary_closing(np.pad(floor, 1), np.ones((3, 3), bool))[1:-1, 1:-1]
    np.testing.assert_array_equal(occupancy._closed(floor), closed)
