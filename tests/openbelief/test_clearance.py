"""What the lidar sees that the map does not know."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief.clearance import MIN_POINTS, crowded, goal_blocked, unmapped, way_blocked
from openbelief.pose import Pose2
from openbelief.traversability import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

ROBOT = Pose2(1.0, 1.0, 0.0)


@pytest.fixture
def grid():
    """4 m x 4 m of floor with one mapped wall at x = 3 m; unknown beyond it."""
    cells = np.full((80, 80), FREE, np.int8)
    cells[:, 60] = OCCUPIED
    cells[:, 61:] = UNKNOWN
    return OccupancyGrid(cells, 0.05, (0.0, 0.0))


def blob(x, y, z=0.8, count=20):
    """(count, 3) points within 2 cm."""
    return np.array([x, y, z]) + np.random.default_rng(0).uniform(-0.02, 0.02, (count, 3))


@pytest.mark.parametrize(
    ("points", "seen"),
    [
        (blob(2.0, 1.0), True),
        (blob(2.0, 1.0, z=0.02), False),  # floor
        (blob(2.0, 1.0, z=1.9), False),  # it walks under that
        (blob(1.1, 1.0), False),  # its own arm
        (blob(2.95, 1.0), False),  # the wall that the map knows
        (blob(3.5, 1.0), False),  # on unknown floor: no goal lies there
        (blob(9.0, 1.0), False),  # off the map
    ],
)
def test_only_what_stands_on_free_floor_counts(grid, points, seen):
    assert (len(unmapped(points.astype(np.float32), grid, ROBOT)) > 0) == seen


def test_a_goal_with_something_on_it_is_blocked_and_a_few_stray_points_are_not(grid):
    goal = Pose2(2.0, 1.0, 0.0)
    assert "where the robot would" in goal_blocked(unmapped(blob(2.2, 1.0), grid, ROBOT), goal)
    assert goal_blocked(unmapped(blob(2.2, 1.0, count=MIN_POINTS - 1), grid, ROBOT), goal) is None
    assert goal_blocked(unmapped(blob(2.6, 1.0), grid, ROBOT), goal) is None


def test_a_way_is_blocked_where_something_stands_on_it_and_it_says_how_far(grid):
    way = np.column_stack((np.arange(1.0, 2.8, 0.05), np.ones(36)))
    said = way_blocked(unmapped(blob(2.4, 1.0), grid, ROBOT), way)
    assert "1.2 m from here" in said  # where its body would touch: 0.25 m before
    assert way_blocked(unmapped(blob(2.4, 1.5), grid, ROBOT), way) is None
    assert way_blocked(unmapped(blob(2.4, 1.0), grid, ROBOT), np.zeros((0, 2))) is None


def test_a_way_told_by_two_far_points_is_looked_at_all_along(grid):
    assert "on the way" in way_blocked(unmapped(blob(2.0, 1.0), grid, ROBOT), [[1.0, 1.0], [2.8, 1.0]])
    assert way_blocked(unmapped(blob(2.0, 1.4), grid, ROBOT), [[1.0, 1.0], [2.8, 1.0]]) is None


def test_somebody_beside_an_arrived_robot_crowds_it(grid):
    assert crowded(unmapped(blob(1.42, 1.0), grid, ROBOT), ROBOT)
    assert crowded(unmapped(blob(1.6, 1.0), grid, ROBOT), ROBOT) is None
