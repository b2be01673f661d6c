"""ROS messages to our types and back."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.livox.assembler import LivoxCloud
from drivers.livox.wire import TimeType
from drivers.ports import LidarCloud
from drivers.ros.calibration import intrinsics
from drivers.ros.clouds import cloud_message, cloud_of
from drivers.ros.convert import (
    grid_message,
    grid_of,
    path_message,
    path_of,
    pose_message,
    pose_of,
    transforms_message,
    transforms_of,
)
from drivers.ros.image_messages import camera_frame_of, camera_info_message, color_message, depth_message, jpeg_message
from drivers.ros.images import color_image, depth_image
from drivers.ros.messages import WireError, decode, encode
from drivers.ros.transform_tree import TransformTree
from openbelief.observation import Intrinsics
from openbelief.pose import Pose2, quaternion_from_rpy, transform
from openbelief.traversability import OccupancyGrid

CAMERA = "camera_color_optical_frame"
INTRINSICS = Intrinsics(8, 6, 5.0, 5.5, 3.5, 2.5, (0.1, -0.02, 0.0, 0.001, 0.0))


def wire(message):
    """Through the bytes and back."""
    return decode(encode(message), message.__msgtype__)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


@pytest.fixture
def parts(rng):
    color = rng.integers(0, 256, (6, 8, 3), dtype=np.uint8)
    depth_m = rng.integers(0, 6000, (6, 8)) / 1000
    return color, depth_m


def test_a_camera_frame_survives_the_wire(parts):
    color, depth_m = parts
    messages = (
        color_message(7, CAMERA, color),
        depth_message(7, CAMERA, depth_m),
        camera_info_message(7, CAMERA, INTRINSICS),
    )
    frame = camera_frame_of(*map(wire, messages))
    assert (frame.color == color).all() and np.allclose(frame.depth_m, depth_m, atol=1e-6)
    assert (frame.stamp_ns, frame.frame_id, frame.intrinsics) == (7, CAMERA, INTRINSICS)


def test_a_jpeg_frame_keeps_red_red():
    color = np.zeros((48, 64, 3), np.uint8)
    color[..., 0] = 200
    intrinsics = Intrinsics(64, 48, 50.0, 50.0, 31.5, 23.5)
    messages = (
        jpeg_message(7, CAMERA, color),
        depth_message(7, CAMERA, np.ones((48, 64))),
        camera_info_message(7, CAMERA, intrinsics),
    )
    frame = camera_frame_of(*map(wire, messages))
    assert abs(frame.color.astype(int) - color).max() < 8


def test_parts_of_different_stamps_are_no_frame(parts):
    color, depth_m = parts
    with pytest.raises(WireError, match="one stamp"):
        camera_frame_of(
            color_message(7, CAMERA, color),
            depth_message(8, CAMERA, depth_m),
            camera_info_message(7, CAMERA, INTRINSICS),
        )


def test_depth_that_is_not_aligned_to_colour_is_refused(parts):
    color, _ = parts
    with pytest.raises(WireError, match="aligned to colour"):
        camera_frame_of(
            color_message(7, CAMERA, color),
            depth_message(7, CAMERA, np.ones((12, 15))),
            camera_info_message(7, CAMERA, INTRINSICS),
        )


def test_depth_of_the_same_view_in_fewer_pixels_is_fitted_to_colour(parts):
    color, depth_m = parts
    frame = camera_frame_of(
        color_message(7, CAMERA, color),
        depth_message(7, CAMERA, depth_m[:3, :4]),
        camera_info_message(7, CAMERA, INTRINSICS),
    )
    np.testing.assert_allclose(frame.depth_m, depth_m[:3, :4].repeat(2, axis=0).repeat(2, axis=1), atol=1e-6)


def test_a_calibration_is_no_measurement_its_stamp_does_not_count(parts):
    color, depth_m = parts
    messages = color_message(7, CAMERA, color), depth_message(7, CAMERA, depth_m)
    assert camera_frame_of(*messages, camera_info_message(0, CAMERA, INTRINSICS)).stamp_ns == 7


def test_a_cloud_survives_the_wire_without_its_no_returns(rng):
    points = rng.normal(size=(50, 3)).astype(np.float32)
    points[3], points[7] = 0.0, np.nan
    cloud = cloud_of(wire(cloud_message(LidarCloud(9, points, "livox_frame"))))
    assert (cloud.points == np.delete(points, [3, 7], axis=0)).all()
    assert (cloud.stamp_ns, cloud.frame_id) == (9, "livox_frame")


def test_a_livox_cloud_tells_all_that_the_lidar_knows_of_each_point_in_livox_ros_driver2s_layout():
    points = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], np.float32)
    known = {"offset_ns": np.array([0, 99_000_000]), "reflectivity": np.uint8([7, 250]), "tag": np.uint8([0, 0x20])}
    counts = {"sequence": 1, "packets": 2, "no_returns": 0, "doubtful": 0}
    stamp_ns = 1_700_000_000_123_456_789
    livox = LivoxCloud(stamp_ns, points, "livox_frame", **known, device_stamp_ns=5, time_type=TimeType.UPTIME, **counts)
    message = wire(cloud_message(livox))
    assert [(f.name, f.offset, f.datatype) for f in message.fields] == [
        ("x", 0, 7),
        ("y", 4, 7),
        ("z", 8, 7),
        ("intensity", 12, 7),
        ("tag", 16, 2),
        ("line", 17, 2),
        ("timestamp", 18, 8),
    ]
    assert message.point_step == 26
    told = np.frombuffer(message.data.tobytes(), "<f4, <f4, <f4, <f4, u1, u1, <f8")
    assert told["f3"].tolist() == [7.0, 250.0] and told["f4"].tolist() == [0, 0x20]
    assert np.abs(told["f6"] - (stamp_ns + known["offset_ns"])).max() <= 256, "a float64 holds no more"
    np.testing.assert_array_equal(cloud_of(message).points, points)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda m: setattr(m, "point_step", 10), "do not fit its point step of 10"),
        (lambda m: setattr(m, "width", 1000), "1000 points"),
        (lambda m: m.fields.clear(), "fields x, y and z"),
        (lambda m: setattr(m.fields[0], "offset", 4000), "do not fit"),
        (lambda m: setattr(m.fields[0], "datatype", 2), "each one float"),
    ],
)
def test_a_malformed_cloud_is_refused(spoil, words):
    message = cloud_message(LidarCloud(9, np.ones((5, 3), np.float32), "livox_frame"))
    spoil(message)
    with pytest.raises(WireError, match=words):
        cloud_of(message)


def test_a_map_survives_the_wire(rng):
    grid = OccupancyGrid(rng.integers(-1, 101, (4, 5)).astype(np.int8), 0.05, (-1.25, 2.5), 11)
    back = grid_of(wire(grid_message(grid)))
    assert (back.cells == grid.cells).all() and back.cells.dtype == np.int8
    assert (back.resolution_m, back.origin_xy, back.stamp_ns) == (0.05, (-1.25, 2.5), 11)


def test_a_turned_map_is_refused():
    message = grid_message(OccupancyGrid(np.zeros((4, 5), np.int8), 0.05, (0.0, 0.0)))
    message.info.origin.orientation.z, message.info.origin.orientation.w = np.sin(0.05), np.cos(0.05)
    with pytest.raises(WireError, match="turned against the map axes"):
        grid_of(message)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda m: setattr(m.header, "frame_id", "odom"), "frame 'map'"),
        (lambda m: setattr(m.info, "resolution", 0.0), "cells of 0.0 m"),
        (lambda m: setattr(m.info, "width", 50), "50x4"),
        (lambda m: setattr(m, "data", np.full(20, 101, np.int8)), "-1 to 100"),
        (lambda m: setattr(m.info.origin.orientation, "w", 0.0), "not a rotation"),
    ],
)
def test_a_malformed_map_is_refused(spoil, words):
    message = grid_message(OccupancyGrid(np.zeros((4, 5), np.int8), 0.05, (0.0, 0.0)))
    spoil(message)
    with pytest.raises(WireError, match=words):
        grid_of(message)


def test_transforms_survive_the_wire_into_a_tree():
    T = transform([1.0, -2.0, 0.5], quaternion_from_rpy(0.3, -0.2, 2.0))
    tree = TransformTree()
    for t in transforms_of(wire(transforms_message(5, [("map", "odom", T)]))):
        tree.add(t.stamp_ns, t.parent, t.child, t.translation, t.quaternion_xyzw)
    assert np.allclose(tree.lookup(5, "map", "odom"), T)


@pytest.mark.parametrize("yaw", [-3.0, -0.5, 0.0, 1.5, 3.1])
def test_a_pose_survives_the_wire(yaw):
    back = pose_of(wire(pose_message(Pose2(1.5, -2.5, yaw))))
    assert (back.x, back.y, back.yaw) == pytest.approx((1.5, -2.5, yaw))


def test_a_pose_of_another_frame_is_refused():
    message = pose_message(Pose2(1.0, 2.0, 0.0))
    message.header.frame_id = "odom"
    with pytest.raises(WireError, match="frame 'map'"):
        pose_of(message)


def test_a_path_survives_the_wire_empty_or_not():
    points = np.array([[0.0, 1.0], [2.0, 3.0]])
    assert (path_of(wire(path_message(points, 3))) == points).all()
    assert path_of(wire(path_message(np.zeros((0, 2)), 3))).shape == (0, 2)


def _refuses_or_converts(payload, type_name, convert):
    try:
        convert(decode(payload, type_name))
    except ValueError as error:  # WireError and ImageRefused
        assert str(error)


@pytest.mark.parametrize(
    ("message", "convert"),
    [
        (cloud_message(LidarCloud(9, np.ones((4, 3), np.float32), "livox_frame")), cloud_of),
        (grid_message(OccupancyGrid(np.zeros((4, 5), np.int8), 0.05, (0.0, 0.0))), grid_of),
        (pose_message(Pose2(1.0, 2.0, 0.5)), pose_of),
        (path_message(np.ones((3, 2)), 0), path_of),
        (transforms_message(5, [("map", "odom", np.eye(4))]), transforms_of),
        (color_message(5, CAMERA, np.zeros((3, 4, 3), np.uint8)), color_image),
        (depth_message(5, CAMERA, np.ones((3, 4))), depth_image),
        (camera_info_message(5, CAMERA, INTRINSICS), intrinsics),
    ],
    ids=lambda value: getattr(value, "__msgtype__", ""),
)
def test_flipped_bits_are_refused_or_converted_never_anything_else(message, convert):
    payload, rng = encode(message), np.random.default_rng(11)
    for _ in range(400):
        flipped = bytearray(payload)
        for position in rng.integers(4, len(payload), 2):
            flipped[position] ^= 1 << int(rng.integers(0, 8))
        _refuses_or_converts(bytes(flipped), message.__msgtype__, convert)
