from __future__ import annotations

import numpy as np
import pytest

from drivers.ports import LidarCloud
from drivers.ros_clouds import cloud_message
from drivers.ros_convert import grid_message, transforms_message
from logs.frames import RecordingError
from logs.surroundings import lidar_clouds, navigation_map
from openbelief.pose import transform
from openbelief.traversability import OccupancyGrid


def test_the_newest_map_is_read_and_its_absence_named(make_walk, tmp_path):
    walk = make_walk(1)
    with pytest.raises(RecordingError, match="holds no navigation map on /map"):
        navigation_map(walk.write(tmp_path / "none.mcap"))
    for at, value in ((1, 0), (2, 100)):
        grid = OccupancyGrid(np.full((3, 4), value, np.int8), 0.05, (-1.0, 2.0), at)
        walk.messages.append(("/map", at, grid_message(grid)))
    newest = navigation_map(walk.write(tmp_path / "walk.mcap"))
    assert newest.cells.shape == (3, 4) and (newest.cells == 100).all() and newest.origin_xy == (-1.0, 2.0)


def test_clouds_come_posed_and_those_without_a_transform_do_not_come(make_walk, tmp_path):
    walk = make_walk(2)
    upside_down = transform([0, 0, 1.27], [1, 0, 0, 0])
    walk.messages.append(("/tf_static", 1, transforms_message(1, [("base_link", "livox_frame", upside_down)])))
    points = np.array([[1.0, 0.0, 0.5]], np.float32)
    inside, outside = walk.stamps[1], walk.stamps[1] + 10**10
    walk.messages += [
        ("/livox/lidar", s, cloud_message(LidarCloud(s, points, "livox_frame"))) for s in (inside, outside)
    ]
    [(cloud, T_map_lidar)] = lidar_clouds(walk.write(tmp_path / "walk.mcap"))
    assert cloud.stamp_ns == inside
    np.testing.assert_allclose(T_map_lidar[:3, 3], [0, 0.5 * (inside - 1_000_000_000) / 1e9, 1.27], atol=1e-9)
    np.testing.assert_allclose(T_map_lidar[2, 2], -1, atol=1e-9)
