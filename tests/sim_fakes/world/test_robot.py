from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.clock import SimClock
from openbelief.g1 import BODY_RADIUS_M
from openbelief.pose import Pose2, wrap_angle
from openbelief.traversability import FREE, OCCUPIED, OccupancyGrid
from sim_fakes.world.robot import Clearance, LocalisationError, SimRobot


class Yard:
    """10 m x 10 m with a wall along x = 5 that has a door at y = 8-9.5."""

    def occupancy_grid(self) -> OccupancyGrid:
        cells = np.full((200, 200), FREE, np.int8)
        cells[:160, 100:102] = OCCUPIED
        cells[190:, 100:102] = OCCUPIED
        return OccupancyGrid(cells, 0.05, (0.0, 0.0))


def drive(robot: SimRobot, clock: SimClock, limit_s: float = 120.0) -> list[Pose2]:
    poses = [robot.pose]
    while robot.moving and clock.now_ns() < limit_s * 1e9:
        clock.sleep(0.02)
        poses.append(robot.pose)
    return poses


def test_it_walks_the_polyline_and_turns_to_the_final_yaw():
    clock = SimClock(0)
    robot = SimRobot(Yard(), clock, Pose2(1, 1, 0))
    robot.follow(np.array([[3.0, 1.0], [3.0, 8.7], [7.0, 8.7]]), 2.0)
    poses = drive(robot, clock)
    assert not robot.moving
    assert robot.blocked is None
    assert np.hypot(robot.pose.x - 7.0, robot.pose.y - 8.7) < 0.05
    assert abs(wrap_angle(robot.pose.yaw - 2.0)) < 0.03
    assert any(np.hypot(p.x - 3, p.y - 1) < 0.2 for p in poses)


def test_it_keeps_to_its_speeds():
    clock = SimClock(0)
    robot = SimRobot(Yard(), clock, Pose2(1, 1, 3.0))
    robot.follow(np.array([[3.0, 1.0], [1.5, 4.0]]), 0.0)
    poses = drive(robot, clock)
    steps = [a.distance_to(b) / 0.02 for a, b in pairwise(poses)]
    turns = [abs(wrap_angle(b.yaw - a.yaw)) / 0.02 for a, b in pairwise(poses)]
    assert 0.45 < max(steps) <= 0.5 + 1e-9
    assert 0.9 < max(turns) <= 1.0 + 1e-9
    assert max(np.diff([0.0, *steps])) <= 0.8 * 0.02 + 1e-9


@settings(max_examples=8, deadline=None)
@given(st.lists(st.tuples(st.floats(-3, 13), st.floats(-3, 13)), min_size=1, max_size=4))
def test_it_never_passes_a_wall_whatever_it_is_told(path):
    clock = SimClock(0)
    robot = SimRobot(Yard(), clock, Pose2(2, 2, 0))
    clearance = Clearance(Yard().occupancy_grid())
    robot.follow(np.array(path), 0.0)
    for pose in drive(robot, clock, limit_s=40.0)[::5]:
        assert clearance.at(pose.x, pose.y) >= BODY_RADIUS_M - 0.06


def test_a_wall_in_the_way_blocks_it_with_a_reason():
    clock = SimClock(0)
    robot = SimRobot(Yard(), clock, Pose2(2, 2, 0))
    robot.follow(np.array([[8.0, 2.0]]), 0.0)
    drive(robot, clock)
    assert not robot.moving
    assert robot.pose.x < 5.0 - BODY_RADIUS_M + 0.05
    assert "obstacle" in (robot.blocked or "")


def test_halt_stops_it_where_it_stands():
    clock = SimClock(0)
    robot = SimRobot(Yard(), clock, Pose2(1, 1, 0))
    robot.follow(np.array([[4.0, 1.0]]), 0.0)
    clock.sleep(2.0)
    robot.halt()
    here = robot.pose
    clock.sleep(2.0)
    assert not robot.moving
    assert robot.pose == here
    assert 1.0 < here.x < 3.0


def test_standing_in_a_wall_is_refused():
    with pytest.raises(ValueError, match="does not fit"):
        SimRobot(Yard(), SimClock(0), Pose2(5.0, 1.0, 0))


def test_where_it_is_carried_it_stands():
    clock = SimClock(0)
    robot = SimRobot(Yard(), clock, Pose2(1, 1, 0))
    robot.follow(np.array([[4.0, 1.0]]), 0.0)
    clock.sleep(2.0)
    with pytest.raises(ValueError, match="does not fit"):
        robot.place(Pose2(5.0, 1.0, 0))
    assert robot.moving
    robot.place(Pose2(2.0, 6.0, 1.0))
    clock.sleep(2.0)
    assert (robot.pose, robot.moving) == (Pose2(2.0, 6.0, 1.0), False)


@pytest.mark.parametrize("path", [np.zeros((0, 2)), np.zeros((2, 3)), np.array([[np.nan, 0.0]])])
def test_a_path_that_is_no_path_is_refused(path):
    robot = SimRobot(Yard(), SimClock(0), Pose2(1, 1, 0))
    with pytest.raises(ValueError, match="path_xy"):
        robot.follow(path, 0.0)


def test_the_camera_sees_the_floor_where_the_real_one_does():
    robot = SimRobot(Yard(), SimClock(0), Pose2(1, 1, 0))
    T, K = robot.T_map_camera(), robot.intrinsics
    rays = np.column_stack((K.rays(np.array([K.cx, K.cx]), np.array([-0.5, 479.5])), np.ones(2))) @ T[:3, :3].T
    ahead = T[0, 3] + rays[:, 0] * (T[2, 3] / -rays[:, 2]) - T[0, 3]
    assert T[2, 3] == pytest.approx(1.265, abs=1e-3)
    assert ahead[::-1] == pytest.approx([0.49, 2.55], abs=0.02)
    assert robot.T_map_lidar()[2, 2] < -0.99  # upside down


def test_localisation_errs_within_its_bounds_and_the_same_way_each_time():
    clock = SimClock(0)
    error = LocalisationError(position_m=0.05, yaw_rad=0.02, seed=3)
    robot = SimRobot(Yard(), clock, Pose2(1, 1, 0), error)
    robot.follow(np.array([[4.0, 1.0], [4.0, 6.0]]), 0.0)
    off = []
    while robot.moving:
        clock.sleep(0.5)
        off.append(robot.pose.distance_to(robot.believed_pose))
        assert abs(wrap_angle(robot.believed_pose.yaw - robot.pose.yaw)) <= 0.02 + 1e-9
    assert 0.005 < max(off) <= 0.05 * np.sqrt(2)
    assert error.at(2.0).tolist() == LocalisationError(0.05, 0.02, 3).at(2.0).tolist()
    assert error.at(2.0).tolist() != LocalisationError(0.05, 0.02, 4).at(2.0).tolist()
