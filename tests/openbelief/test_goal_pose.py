"""Where to stand to look at a thing, and what is said when there is no such place."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief import goal_pose
from openbelief.g1 import COLOR_INTRINSICS, T_BASE_CAMERA
from openbelief.goal_pose import SPREAD_M, GoalSearch, goal_poses
from openbelief.parameters import Parameters
from openbelief.polyline import path_length
from openbelief.pose import Pose2
from openbelief.traversability import OCCUPIED, UNKNOWN, OccupancyGrid, path

PARAMETERS = Parameters()
ROBOT = Pose2(1.0, 1.0, 0.0)


def room(size_m: float = 6.0) -> OccupancyGrid:
    """An empty square room with walls 0.1 m thick; the corner of the map is the origin."""
    n = round(size_m / 0.05)
    cells = np.zeros((n, n), np.int8)
    cells[:2] = cells[-2:] = OCCUPIED
    cells[:, :2] = cells[:, -2:] = OCCUPIED
    return OccupancyGrid(cells, 0.05, (0.0, 0.0))


def fill(grid: OccupancyGrid, x: tuple[float, float], y: tuple[float, float], value: int = OCCUPIED) -> None:
    grid.cells[round(y[0] / 0.05) : round(y[1] / 0.05), round(x[0] / 0.05) : round(x[1] / 0.05)] = value


def box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> np.ndarray:
    """The surface of a box as voxel centres."""
    axes = [np.arange(round(a / 0.02), round(b / 0.02)) * 0.02 + 0.01 for a, b in (x, y, z)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    surface = np.ones(grid.shape[:3], bool)
    surface[1:-1, 1:-1, 1:-1] = False
    return grid[surface].astype(np.float32)


def search(points: np.ndarray, grid: OccupancyGrid, robot: Pose2 = ROBOT, limit: int = 4) -> GoalSearch:
    return goal_poses(points, grid, robot, T_BASE_CAMERA, COLOR_INTRINSICS, PARAMETERS, limit)


def test_a_bin_on_open_floor_is_looked_at_from_the_nearest_side() -> None:
    grid, points = room(), box((3.0, 3.3), (3.0, 3.3), (0.0, 0.4))
    fill(grid, (3.0, 3.3), (3.0, 3.3))
    found = search(points, grid)
    best = found.poses[0]
    boundary = np.linalg.norm(points[:, :2] - best.pose.xy, axis=1).min()
    assert 0.5 <= boundary <= 1.2
    assert best.pose.yaw == pytest.approx(np.arctan2(3.15 - best.pose.y, 3.15 - best.pose.x), abs=0.01)
    assert best.expected_visibility >= PARAMETERS.tau_nu
    assert best.pose.distance_to(ROBOT) < np.hypot(2.15, 2.15) - 0.5  # this side of it
    way = path(grid.inflated(0.35), ROBOT.xy, best.pose.xy)
    assert best.path_length_m == pytest.approx(path_length(way), abs=0.1)


def test_every_pose_is_free_with_room_for_the_robot_and_the_poses_are_different_views() -> None:
    grid, points = room(), box((3.0, 3.3), (3.0, 3.3), (0.0, 0.4))
    fill(grid, (3.0, 3.3), (3.0, 3.3))
    poses = [goal.pose for goal in search(points, grid).poses]
    assert len(poses) == 4
    assert all(grid.inflated(0.35).free[tuple(grid.cell(pose.xy))] for pose in poses)
    assert min(a.distance_to(b) for i, a in enumerate(poses) for b in poses[:i]) >= SPREAD_M


def test_a_picture_high_on_a_wall_can_be_seen_from_nowhere_and_the_reason_has_the_numbers() -> None:
    found = search(box((5.84, 5.9), (2.5, 3.1), (1.4, 1.8)), room())
    assert found.poses == []
    assert found.reason == (
        "No pose can see it: its lowest point is 1.4 m up, the camera sees nothing above 0.67 m at 1.2 m."
    )


def test_where_no_pose_sees_it_the_nearest_places_to_stand_are_left_for_a_person_to_decide() -> None:
    points, grid = box((5.84, 5.9), (2.5, 3.1), (1.4, 1.8)), room()
    blind = search(points, grid).blind
    assert blind and all(goal.expected_visibility < Parameters().tau_nu for goal in blind)
    assert all(grid.inflated(0.35).free[tuple(grid.cell(goal.pose.xy))] for goal in blind)
    assert [goal.path_length_m for goal in blind] == sorted(goal.path_length_m for goal in blind)
    assert search(box((2.0, 2.3), (2.0, 2.3), (0.0, 0.4)), grid).blind == ()


def test_a_thing_outside_the_map_is_said_to_be_outside() -> None:
    assert search(box((20.0, 20.2), (3.0, 3.2), (0.0, 0.3)), room()).reason == "It is outside the map."


def test_a_thing_buried_in_clutter_has_no_free_floor_near_it() -> None:
    grid = room()
    fill(grid, (2.0, 6.0), (2.0, 6.0))
    found = search(box((4.0, 4.2), (4.0, 4.2), (0.0, 0.3)), grid)
    assert found.poses == [] and "no free floor 0.5-1.2 m from it" in found.reason


@pytest.mark.parametrize("between", [OCCUPIED, UNKNOWN])
def test_a_room_without_a_known_way_in_is_not_reachable(between: int) -> None:
    grid = room()
    fill(grid, (2.0, 2.2), (0.1, 5.9), between)
    found = search(box((4.0, 4.2), (4.0, 4.2), (0.0, 0.3)), grid)
    assert found.poses == [] and found.reason == "There is no way to it over known free floor."


def test_a_thing_behind_a_wall_is_not_looked_at_from_the_walls_other_side() -> None:
    grid = room()
    fill(grid, (3.0, 3.1), (0.1, 4.8))  # a wall with a gap at its far end
    points = box((3.2, 3.4), (1.0, 1.2), (0.0, 0.4))  # nearest from (1, 1) as the crow flies: through the wall
    fill(grid, (3.2, 3.4), (1.0, 1.2))
    found = search(points, grid)
    assert found.poses and all(goal.pose.x > 3.1 for goal in found.poses)
    fill(grid, (3.0, 3.1), (4.8, 5.9))
    assert "line of sight" in search(points, grid).reason


def test_a_lamp_on_a_table_is_looked_at_over_the_table() -> None:
    grid = room()
    fill(grid, (3.0, 4.0), (2.5, 3.5))
    lamp = box((3.3, 3.4), (2.9, 3.1), (0.5, 0.8))
    assert search(lamp, grid).poses  # heights unknown: the least obstructed side
    heights = np.where(grid.cells == OCCUPIED, np.float32(1.5), np.nan)
    heights[50:70, 60:80] = 0.5
    known = OccupancyGrid(grid.cells, 0.05, (0.0, 0.0), heights_m=heights)
    assert len(search(lamp, known).poses) >= len(search(lamp, grid).poses)


def test_a_robot_inside_the_margin_of_an_obstacle_still_finds_its_way() -> None:
    found = search(box((3.0, 3.3), (3.0, 3.3), (0.0, 0.4)), room(), robot=Pose2(0.25, 1.0, 0.0))
    assert found.poses and np.isfinite(found.poses[0].path_length_m)


def test_a_robot_off_the_map_is_told_so() -> None:
    found = search(box((3.0, 3.3), (3.0, 3.3), (0.0, 0.4)), room(), robot=Pose2(-3.0, 1.0, 0.0))
    assert found.poses == [] and "outside the map" in found.reason


def test_however_large_the_map_and_the_object_the_view_is_judged_from_a_bounded_number_of_places(monkeypatch) -> None:
    grid = room(20.0)
    points = box((9.0, 11.0), (9.0, 10.0), (0.0, 0.8))[::4][:5000]
    fill(grid, (9.0, 11.0), (9.0, 10.0))
    judged = []
    judge = goal_pose.expected_visibility
    monkeypatch.setattr(goal_pose, "expected_visibility", lambda *a: judged.append(a) or judge(*a))
    assert search(points, grid).poses
    assert 0 < len(judged) <= 2 * goal_pose.MAX_TRIED
    assert all(len(points) <= goal_pose.MAX_POINTS for points, *_ in judged)


def test_the_same_question_has_the_same_answer() -> None:
    points = box((3.0, 3.3), (3.0, 3.3), (0.0, 0.4))
    assert search(points, room()) == search(points, room())


def test_bad_points_are_refused() -> None:
    with pytest.raises(ValueError, match="points"):
        search(np.full((3, 3), np.nan), room())


def test_fewer_poses_asked_for_are_the_first_of_more_and_no_more_views_are_judged_than_that_takes(monkeypatch) -> None:
    points, judged = box((4.0, 4.3), (4.0, 4.3), (0.0, 0.4)), []
    judge = goal_pose.expected_visibility
    monkeypatch.setattr(goal_pose, "expected_visibility", lambda *a: judged.append(a) or judge(*a))
    many, all_judged = search(points, room(), limit=50).poses, len(judged)
    judged.clear()
    assert search(points, room(), limit=2).poses == many[:2] and len(many) > 4
    assert len(judged) < all_judged / 2
