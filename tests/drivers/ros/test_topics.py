"""Camera, pose, map and lidar over real sessions: fresh data or a refusal that names its cause."""

from __future__ import annotations

import logging

import numpy as np
import pytest

import drivers.ros.camera
from drivers.ports import PoseUnavailable, StaleData
from drivers.ros.camera import PairingTolerance, StampPairs
from drivers.ros.clouds import CUSTOM_MSG
from drivers.ros.convert import transforms_message
from drivers.ros.image_messages import camera_info_message, color_message, depth_message
from drivers.ros.messages import encode, header, make
from drivers.topics import CAMERA_INFO, COLOR, DEPTH, LIDAR, MAP, TF, color_topic
from openbelief.pose import Pose2, transform
from sim_fakes.wire.faults import SensorFaults, garbage, not_finite, oversize, truncated

STREAMS = {LIDAR.name, COLOR.name}
READ = {LIDAR.name: lambda rig: rig.lidar.latest(1.0), COLOR.name: lambda rig: rig.camera.latest(1.0)}


def test_everything_arrives_and_is_fresh(rig):
    assert rig.camera.latest(1.0).intrinsics == rig.robot.intrinsics
    assert rig.lidar.latest(1.0).points.tolist() == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    assert rig.map.latest().cells.shape == (80, 120)
    assert rig.poses.robot_pose(0.5).distance_to(Pose2(1.0, 1.0, 0.0)) < 1e-9


@pytest.mark.parametrize("name", sorted(STREAMS))
def test_a_stream_that_ends_grows_stale(rig, name):
    rig.graph.sensor_faults.muted |= STREAMS
    rig.clock.sleep(2.0)
    with pytest.raises(StaleData, match="old, more than 1 s"):
        READ[name](rig)


@pytest.mark.parametrize("name", sorted(STREAMS))
def test_stamps_that_stand_still_are_stale_though_messages_come(rig, name):
    rig.graph.sensor_faults.frozen_ns = rig.clock.now_ns()
    rig.clock.sleep(2.0)
    with pytest.raises(StaleData, match="old, more than 1 s"):
        READ[name](rig)


@pytest.mark.parametrize("spoil", [garbage, truncated, oversize])
@pytest.mark.parametrize("name", sorted(STREAMS))
def test_payloads_that_cannot_be_used_are_counted_and_logged_never_used(rig, name, spoil, caplog):
    rig.graph.sensor_faults.spoiled[name] = spoil
    with caplog.at_level(logging.WARNING, logger="drivers.ros.subscription"):
        rig.clock.sleep(2.0)
    with pytest.raises(StaleData, match="dropped, the last because"):
        READ[name](rig)
    assert name in caplog.text


def test_a_transform_that_is_not_finite_is_named_and_no_pose_is_made_of_it(rig):
    rig.graph.sensor_faults.spoiled[TF.name] = not_finite
    rig.clock.sleep(1.0)
    with pytest.raises(StaleData, match="not rigid"):
        rig.poses.robot_pose(0.5)


def test_one_transform_that_is_not_finite_costs_itself_and_not_the_message(rig):
    """A wheel without an encoder sends NaN beside the robot's pose."""
    rig.graph.sensor_faults.muted |= {TF.name}
    now, T = rig.clock.now_ns(), transform([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])
    wheel = T.copy()
    wheel[0, 3] = np.nan
    edges = [("map", "odom", np.eye(4)), ("odom", "base_link", T), ("base_link", "left_wheel_link", wheel)]
    rig.graph.bridge.publish(TF, encode(transforms_message(now, edges)))
    rig.graph.bridge.flush()
    assert rig.poses.robot_pose(0.5).x == pytest.approx(1.0)
    with pytest.raises(PoseUnavailable, match="left_wheel_link at the stamp is not rigid"):
        rig.poses.transform_at(now, "left_wheel_link")
    rig.clock.sleep(2.0)
    with pytest.raises(StaleData, match=r"1 parts of messages were not used.*base_link -> left_wheel_link"):
        rig.poses.robot_pose(0.5)


def test_a_calibration_of_another_stamp_or_none_serves_every_image(rig):
    rig.graph.sensor_faults.muted |= {COLOR.name, DEPTH.name, CAMERA_INFO.name}
    now, blank, deep = rig.clock.now_ns(), np.zeros((480, 640, 3), np.uint8), np.ones((480, 640))
    bridge = rig.graph.bridge
    bridge.publish(CAMERA_INFO, encode(camera_info_message(0, "camera", rig.robot.intrinsics)))
    bridge.publish(COLOR, encode(color_message(now, "camera", blank)))
    bridge.publish(DEPTH, encode(depth_message(now, "camera", deep)))
    bridge.flush()
    assert rig.camera.latest(60.0).stamp_ns == now


def test_a_camera_whose_depth_comes_with_other_stamps_is_told_what_to_set(make_rig):
    rig = make_rig(sensor_faults=SensorFaults(muted={COLOR.name, DEPTH.name}))
    rig.start()
    now, bridge = rig.clock.now_ns(), rig.graph.bridge
    bridge.publish(COLOR, encode(color_message(now, "camera", np.zeros((480, 640, 3), np.uint8))))
    bridge.publish(DEPTH, encode(depth_message(now + 16_000_000, "camera", np.ones((480, 640)))))
    bridge.flush()
    with pytest.raises(StaleData, match=r"depth \+16.0 ms.*pairing"):
        rig.camera.latest(60.0)


@pytest.mark.parametrize(
    "pairing", [PairingTolerance(tolerance_s=0.02), PairingTolerance(offset_s=0.016)], ids=["tolerance", "offset"]
)
def test_a_camera_whose_depth_comes_late_is_paired_as_it_was_told(pairing):
    pairs, head = StampPairs(pairing), header
    for at in (0, 100):
        pairs.add(0, make("sensor_msgs/msg/Image", header=head(at * 1_000_000, "camera")))
        pairs.add(1, make("sensor_msgs/msg/Image", header=head((at + 16) * 1_000_000, "camera")))
    assert pairs.newest is not None and pairs.newest[0] == 100_000_000


def test_a_livox_custom_msg_on_the_lidars_topic_is_explained(make_rig):
    rig = make_rig(sensor_faults=SensorFaults(muted={LIDAR.name}))
    rig.start()
    points = [make("livox_ros_driver2/msg/CustomPoint", offset_time=i, x=1.0) for i in range(3)]
    custom = make(CUSTOM_MSG, header=header(rig.clock.now_ns(), "livox_frame"), point_num=3, points=points)
    custom.rsvd = np.zeros(3, np.uint8)
    rig.graph.bridge.publish(LIDAR, encode(custom))
    rig.graph.bridge.flush()
    with pytest.raises(StaleData, match=r"CustomMsg.*xfer_format to 0"):
        rig.lidar.latest(60.0)


def test_a_map_that_cannot_be_used_leaves_no_map(make_rig):
    rig = make_rig(sensor_faults=SensorFaults(spoiled={MAP.name: truncated}))
    rig.graph.start(rig.link)
    with pytest.raises(StaleData, match="No map has arrived"):
        rig.map.latest()


def test_a_map_published_before_we_came_still_arrives(make_rig, eventually):
    from drivers.ros.topics import RosMap

    rig = make_rig()
    rig.start()
    late = RosMap(rig.link)
    late.start()
    eventually(lambda: _has_map(late))


def _has_map(grid):
    try:
        return grid.latest() is not None
    except StaleData:
        return False


def test_before_the_first_message_each_port_says_what_is_missing(make_rig):
    rig = make_rig()
    for read, words in (
        (lambda: rig.camera.latest(1.0), "No camera image yet"),
        (lambda: rig.lidar.latest(1.0), "No lidar cloud yet"),
        (rig.map.latest, "No map has arrived"),
        (lambda: rig.poses.robot_pose(1.0), "Is localisation running"),
    ):
        with pytest.raises(StaleData, match=words):
            read()


def test_only_parts_of_one_stamp_make_an_image(rig):
    """Depth comes late by one image: no frame mixes two moments."""
    rig.graph.sensor_faults.muted |= {COLOR.name, DEPTH.name, CAMERA_INFO.name}
    before, now = rig.camera.latest(60.0).stamp_ns, rig.clock.now_ns()
    blank, deep, intrinsics = np.zeros((480, 640, 3), np.uint8), np.ones((480, 640)), rig.robot.intrinsics
    bridge = rig.graph.bridge
    bridge.publish(COLOR, encode(color_message(now, "camera", blank)))
    bridge.publish(CAMERA_INFO, encode(camera_info_message(now, "camera", intrinsics)))
    bridge.publish(DEPTH, encode(depth_message(now - 1, "camera", deep)))
    bridge.flush()
    assert rig.camera.latest(60.0).stamp_ns == before
    bridge.publish(DEPTH, encode(depth_message(now, "camera", deep)))
    bridge.flush()
    assert rig.camera.latest(60.0).stamp_ns == now


def test_an_image_that_does_not_decode_is_named_and_not_used(rig, monkeypatch):
    rig.graph.sensor_faults.muted |= {COLOR.name, DEPTH.name, CAMERA_INFO.name}
    now, intrinsics, bridge = rig.clock.now_ns(), rig.robot.intrinsics, rig.graph.bridge
    color = color_message(now, "camera", np.zeros((480, 640, 3), np.uint8))
    color.encoding = "32SC3"
    bridge.publish(COLOR, encode(color))
    bridge.publish(DEPTH, encode(depth_message(now, "camera", np.ones((480, 640)))))
    bridge.publish(CAMERA_INFO, encode(camera_info_message(now, "camera", intrinsics)))
    bridge.flush()
    decoded = []
    real = drivers.ros.camera.camera_frame_of
    monkeypatch.setattr("drivers.ros.camera.camera_frame_of", lambda *a, **b: decoded.append(1) or real(*a, **b))
    for _ in range(20):
        with pytest.raises(StaleData, match="32SC3"):
            rig.camera.latest(60.0)
    assert len(decoded) == 1, "what cannot be decoded is not decoded again at every poll"


def test_the_image_taken_at_a_stop_shows_the_stop(make_rig):
    rig = make_rig(camera_rate_hz=0.01)
    rig.start()
    rig.nav.send(Pose2(2.0, 1.0, 0.0))
    rig.until_end()
    rig.clock.sleep(0.1)
    frame = rig.camera.latest(0.5)
    assert np.allclose(rig.poses.transform_at(frame.stamp_ns, frame.frame_id), rig.robot.T_map_camera())


def test_a_pose_at_an_images_stamp_is_where_the_camera_was(rig):
    rig.nav.send(Pose2(3.5, 3.0, 1.0))
    rig.clock.sleep(3.0)
    frame = rig.camera.latest(2.0)
    T_map_camera = rig.poses.transform_at(frame.stamp_ns, frame.frame_id)
    assert T_map_camera[2, 3] == pytest.approx(rig.robot.T_base_camera[2, 3], abs=1e-6)
    assert 1.0 < T_map_camera[0, 3] < 3.6


def test_a_stamp_just_ahead_of_the_transforms_is_waited_for(rig):
    stamp_ns = rig.clock.now_ns() + 40_000_000
    rig.poses.transform_at(stamp_ns, "base_link")
    assert rig.clock.now_ns() >= stamp_ns


def test_a_stamp_that_no_transform_will_cover_is_refused_in_time(rig):
    asked_ns = rig.clock.now_ns()
    with pytest.raises(PoseUnavailable):
        rig.poses.transform_at(asked_ns + 5_000_000_000, "base_link")
    assert rig.clock.now_ns() - asked_ns < 500_000_000


def test_the_colour_topics_type_follows_its_name():
    assert color_topic("/front/image/compressed").type_name == "sensor_msgs/msg/CompressedImage"
    assert color_topic("/front/image").type_name == "sensor_msgs/msg/Image"


def test_a_compressed_colour_topic_makes_frames_too(rig):
    from drivers.ros.image_messages import jpeg_message
    from drivers.ros.topics import RosCamera
    from drivers.topics import COLOR_JPEG

    camera = RosCamera(rig.link, rig.clock, color=COLOR_JPEG)
    camera.start()
    now, bridge, red = rig.clock.now_ns(), rig.graph.bridge, np.zeros((480, 640, 3), np.uint8)
    red[..., 0] = 200
    with pytest.raises(StaleData):
        camera.latest(1.0)
    for _ in range(100):  # until the new subscription is known at the other end
        bridge.publish(COLOR_JPEG, encode(jpeg_message(now, "camera", red)))
        rig.graph.topics.look()
        try:
            frame = camera.latest(1.0)
        except StaleData:
            continue
        break
    assert frame.stamp_ns == now and abs(frame.color.astype(int) - red).max() < 8
