"""A replayed recording's topics are taken by name and role; where several could be meant, the list is shown."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.clock import SimClock
from drivers.ports import LidarCloud
from drivers.ros.clouds import cloud_message
from drivers.ros.convert import grid_message, imu_message
from logs.frames.reader import RecordingError
from openbelief.traversability import OccupancyGrid
from sim_fakes.playback.imu import STANDARD_GRAVITY
from sim_fakes.playback.ports import BuiltMap, RecordingPorts
from sim_fakes.playback.roles import PlayedTopics

START_NS = 1_000_000_000


def clouds(walk, topic, x_m):
    cloud = LidarCloud(0, np.array([[x_m, 0, 0]], np.float32), "livox_frame")
    for at in walk.stamps:
        walk.messages.append((topic, at, cloud_message(LidarCloud(at, cloud.points, cloud.frame_id))))


def grid(walk, topic, value):
    cells = np.full((4, 4), value, np.int8)
    walk.messages.append((topic, START_NS, grid_message(OccupancyGrid(cells, 0.05, (0.0, 0.0), START_NS))))


def ports(walk, tmp_path, **topics) -> RecordingPorts:
    return RecordingPorts(walk.write(tmp_path / "walk.mcap"), PlayedTopics(**topics))


def lidar_x(ports: RecordingPorts) -> float:
    clock = SimClock(START_NS)
    lidar = ports.lidar(clock)
    clock.sleep(0.1)
    return float(lidar.latest(10.0).points[0, 0])


@pytest.mark.parametrize("others", [["/camera/depth/color/points"], ["/local_costmap/voxel_grid", "/a_map_cloud"]])
@pytest.mark.parametrize("name", ["/livox/lidar", "/velodyne_points", "/scan_cloud"])
def test_the_lidar_is_not_the_cloud_of_a_camera_or_of_a_map(make_walk, tmp_path, name, others):
    walk = make_walk(3)
    for other in others:
        clouds(walk, other, 9.0)
    clouds(walk, name, 1.0)
    assert lidar_x(ports(walk, tmp_path)) == 1.0


def test_the_topic_that_robot_toml_names_is_taken(make_walk, tmp_path):
    walk = make_walk(3)
    clouds(walk, "/front/lidar", 1.0)
    clouds(walk, "/rear/lidar", 2.0)
    named = {"lidar": "/rear/lidar", "named": frozenset({"lidar"})}
    assert lidar_x(ports(walk, tmp_path, **named)) == 2.0
    with pytest.raises(RecordingError, match=r"several .* lidar \(/front/lidar, /rear/lidar\): .*\[topics\] lidar"):
        ports(walk, tmp_path).lidar(SimClock(START_NS))
    with pytest.raises(RecordingError, match=r"no lidar topic '/top'.*has: /front/lidar, /rear/lidar"):
        ports(walk, tmp_path, lidar="/top", named=frozenset({"lidar"})).lidar(SimClock(START_NS))


def test_the_map_is_never_a_costmap(make_walk, tmp_path):
    walk = make_walk(3)
    grid(walk, "/global_costmap/costmap", 60)
    assert isinstance(ports(walk, tmp_path).map(SimClock(START_NS)), BuiltMap)
    grid(walk, "/map", 100)
    assert (ports(walk, tmp_path).map(SimClock(START_NS)).latest().cells == 100).all()


def test_the_camera_that_robot_toml_names_is_played_raw_or_compressed(make_walk, tmp_path):
    walk = make_walk(3)
    color = "/camera/color/image_raw/compressed"
    for t, at, m in list(walk.messages):
        if t in (color, "/camera/color/camera_info"):
            walk.messages.append((t.replace("/camera/", "/rear/"), at, m))
    named = PlayedTopics(color="/rear/color/image_raw", named=frozenset({"color"}))
    reader = RecordingPorts(walk.write(tmp_path / "walk.mcap"), named)._reader
    assert reader.plan.topics.color == "/rear/color/image_raw/compressed"
    assert reader.plan.topics.camera_info == "/rear/color/camera_info"


def test_a_recording_whose_clock_was_set_back_is_not_played(make_walk, tmp_path):
    walk = make_walk(3)
    later = [(t, at + 5_000_000_000, m) for t, at, m in walk.messages]
    walk.messages += later
    with pytest.raises(RecordingError, match=r"clock was set back by .* cut it there"):
        ports(walk, tmp_path).camera(SimClock(START_NS))


@pytest.mark.parametrize("in_g", [True, False])
def test_a_livox_drivers_accelerations_in_g_become_metres(make_walk, tmp_path, in_g):
    walk = make_walk(3)
    clouds(walk, "/livox/lidar", 1.0)
    felt = np.array([0.0, 0.02, 1.0]) * (1.0 if in_g else STANDARD_GRAVITY)
    for k in range(50):
        at = START_NS + k * 10_000_000
        walk.messages.append(("/livox/imu", at, imu_message(at, "livox_frame", np.zeros(3), felt)))
    clock = SimClock(START_NS)
    lidar = ports(walk, tmp_path).lidar(clock)
    clock.sleep(0.3)
    samples = lidar.take_imu()
    assert samples and np.allclose([s.acceleration_m_s2[2] for s in samples], STANDARD_GRAVITY)


def test_an_imu_without_an_orientation_is_used_and_one_without_rates_is_counted(make_walk, tmp_path):
    walk = make_walk(3)
    clouds(walk, "/livox/lidar", 1.0)
    for k in range(20):
        at = START_NS + k * 10_000_000
        message = imu_message(at, "livox_frame", np.zeros(3), np.array([0.0, 0.0, 9.8]))
        message.orientation.x = message.orientation.w = float("nan")
        if k == 5:
            message.angular_velocity.x = float("nan")
        walk.messages.append(("/livox/imu", at, message))
    clock = SimClock(START_NS)
    lidar = ports(walk, tmp_path).lidar(clock)
    clock.sleep(0.5)
    assert len(lidar.take_imu()) == 19
    assert dict(lidar.imu.left_out) == {"rate or acceleration not finite": 1}
