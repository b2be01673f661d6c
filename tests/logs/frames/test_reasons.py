"""A refusal keeps what the reader knows: what was missing or wrong, of which frame, and what to do."""

from __future__ import annotations

import re

import cv2
import numpy as np
import pytest

from drivers.ports import PoseUnavailable
from drivers.ros import transform_edge
from drivers.ros.convert import header, transforms_message
from drivers.ros.image_messages import camera_info_message, color_message
from drivers.ros.messages import make
from drivers.ros.refusals import ImageReason
from logs.frames.reader import FrameReader, RecordingError
from logs.frames.reasons import REMEDIES, TRANSFORM_REASONS, FrameReason
from openbelief.pose import transform

MS = 1_000_000
COLOR, DEPTH, INFO = "/camera/color/image_raw/compressed", "/camera/depth/image_rect_raw", "/camera/color/camera_info"
OPTICAL = "camera_color_optical_frame"


def test_every_reason_has_a_remedy_and_every_refusal_of_a_transform_a_reason():
    assert set(REMEDIES) == {*FrameReason, *ImageReason}
    refusals = {k for k in vars(transform_edge).values() if isinstance(k, type) and issubclass(k, PoseUnavailable)}
    assert set(TRANSFORM_REASONS) == refusals - {PoseUnavailable}


def renamed_map(walk):
    for _, _, m in walk.messages:
        for t in getattr(m, "transforms", []):
            t.header.frame_id = t.header.frame_id.replace("map", "camera_init")


def no_static(walk):
    walk.messages = [m for m in walk.messages if m[0] != "/tf_static"]


def slow_localiser(walk):
    walk.messages = [m for m in walk.messages if m[0] != "/tf" or (m[1] - MS) % (300 * MS) == 100 * MS]


def depth_16_ms_late(walk):
    for topic, _, m in walk.messages:
        if topic == DEPTH:
            stamp = m.header.stamp.sec * 1000 * MS + m.header.stamp.nanosec
            m.header = header(stamp + 16 * MS, OPTICAL)


def depth_in_a_frame_nobody_knows(walk):
    for topic, _, m in walk.messages:
        if topic == DEPTH:
            m.header.frame_id = "camera_aligned_depth_to_color_frame"


def strange_colour(walk):
    walk.messages = [(t, at, strange(m) if t == COLOR else m) for t, at, m in walk.messages]


def strange(m):
    raw = color_message(0, OPTICAL, np.zeros((120, 160, 3), np.uint8))
    raw.header, raw.encoding = m.header, "32SC3"
    return raw


def fisheye(walk):
    for topic, _, m in walk.messages:
        if topic == INFO:
            m.distortion_model = "equidistant"


def uncalibrated(walk):
    for topic, _, m in walk.messages:
        if topic == INFO:
            m.k = np.zeros(9)


def other_size(walk):
    for topic, _, m in walk.messages:
        if topic == INFO:
            m.width, m.height, m.binning_x, m.binning_y = 640, 480, 2, 2


def another_view(walk):
    for _, _, m in walk.messages:
        if getattr(m, "encoding", "") == "16UC1":
            m.height, m.data = 100, m.data[: 100 * m.step]


def two_publishers(walk):
    other = [
        ("/tf", at, transforms_message(at + 9 * MS, [("map", "base_link", transform([0.8, 0, 0], [0, 0, 0, 1]))]))
        for topic, at, _ in walk.messages
        if topic == "/tf"
    ]
    walk.messages += other


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (renamed_map, ["no transform to the map", "camera_init", "--map-frame"]),
        (no_static, ["no transform to the map", OPTICAL, "/tf_static"]),
        (slow_localiser, ["stale transform", "0.300 s apart", "--max-tf-gap-s"]),
        (depth_16_ms_late, [r"\+16.0 ms away, as usual here \+16.0 ms", "--pair-tolerance-s", "--depth-offset-s"]),
        (depth_in_a_frame_nobody_knows, ["camera_aligned_depth_to_color_frame", "--depth-is-aligned"]),
        (strange_colour, ["32SC3", "known are rgb8", "image_transport"]),
        (fisheye, ["distortion model not supported", "equidistant", "rectified"]),
        (uncalibrated, ["camera info is not a calibration", "calibrate"]),
        (other_size, ["sizes differ", "colour 160x120", "640x480 with binning 2x2"]),
        (another_view, ["sizes differ", "Colour has 160x120 pixels, depth 160x100"]),
        (two_publishers, ["two publishers", "map -> base_link", r"[01]\.\d\d m", "stop one"]),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_what_is_wrong_with_every_frame_is_said_with_what_was_seen_and_what_to_do(make_walk, tmp_path, spoil, words):
    walk = make_walk()
    spoil(walk)
    reader = FrameReader(walk.write(tmp_path / "walk.mcap"))
    assert list(reader) == []
    for word in [*words, "image 0"]:
        assert re.search(word, reader.why_nothing()), (word, reader.why_nothing())


def test_what_was_missing_can_be_allowed(make_walk, tmp_path):
    """The options that the refusals name."""
    for spoil, options in (
        (slow_localiser, {"max_tf_gap_s": 0.5}),
        (depth_16_ms_late, {"pair_tolerance_s": 0.02}),
        (depth_16_ms_late, {"depth_offset_s": 0.016}),
        (depth_in_a_frame_nobody_knows, {"depth_is_aligned": True}),
        (renamed_map, {"map_frame": "camera_init"}),
    ):
        walk = make_walk()
        spoil(walk)
        reader = FrameReader(walk.write(tmp_path / "walk.mcap"), **options)
        assert len(list(reader)) >= 5, spoil.__name__


@pytest.mark.parametrize(
    ("type_name", "encoding", "words"),
    [
        ("foxglove.RawImage", "protobuf", "foxglove.RawImage as protobuf.*ros2 bag record"),
        ("foxglove.RawImage", "json", "foxglove.RawImage as json"),
        ("foxglove_msgs/msg/CompressedVideo", "cdr", "CompressedVideo: video"),
        ("ffmpeg_image_transport_msgs/msg/FFMPEGPacket", "cdr", "FFMPEGPacket: video"),
        ("my_msgs/Thing", "ros1", "my_msgs/msg/Thing as ros1: only ROS 1 types"),
        ("livox_ros_driver2/msg/CustomMsg", "cdr", "CustomMsg: set xfer_format"),
    ],
)
def test_images_in_a_form_that_is_not_read_are_named_for_what_they_are(tmp_path, type_name, encoding, words):
    from mcap.writer import Writer

    with (tmp_path / "walk.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/image", encoding, writer.register_schema(type_name, "", b""))
        writer.add_message(channel, 0, b"1234", 0)
        writer.finish()
    with pytest.raises(RecordingError, match=f"holds no colour topic.*{words}"):
        list(FrameReader(tmp_path / "walk.mcap"))


def test_a_file_damaged_before_its_first_image_is_called_damaged(make_walk, tmp_path):
    path = make_walk(3).write(tmp_path / "walk.mcap")
    data = bytearray(path.read_bytes())
    data[200] ^= 255  # in the first chunk
    path.write_bytes(data)
    with pytest.raises(RecordingError, match=r"damaged before its first .*checksum .*openbelief recover"):
        list(FrameReader(path))


def test_a_nan_in_one_transform_of_a_batch_costs_that_one_counted_and_named(make_walk, tmp_path):
    walk = make_walk()
    wheel = transform([0, 0, 0], [0, 0, 0, 1])
    wheel[0, 3] = np.nan
    for topic, _, m in walk.messages:
        if topic == "/tf":
            m.transforms += transforms_message(
                m.transforms[0].header.stamp.sec, [("base_link", "wheel", wheel)]
            ).transforms
    reader = FrameReader(walk.write(tmp_path / "walk.mcap"))
    assert len(list(reader)) == 6
    [(reason, count)] = reader.skipped.items()
    assert "base_link -> wheel" in reason and count == sum(t == "/tf" for t, _, _ in walk.messages)


@pytest.mark.parametrize("stamp", ["late", "zero", "once"])
def test_a_calibration_is_no_measurement_and_serves_every_image(make_walk, tmp_path, stamp):
    walk = make_walk()
    infos = [m for m in walk.messages if m[0] == INFO]
    walk.messages = [m for m in walk.messages if m[0] != INFO]
    for topic, at, m in infos[: 1 if stamp == "once" else None]:
        stamp_ns = 0 if stamp == "zero" else at + 33 * MS
        walk.messages.append((topic, at, camera_info_message(stamp_ns, m.header.frame_id, walk.intrinsics)))
    frames = list(FrameReader(walk.write(tmp_path / "walk.mcap")))
    assert len(frames) == 6 and {f.intrinsics for f in frames} == {walk.intrinsics}


def test_an_image_takes_the_calibration_nearest_to_it_where_they_change(make_walk, tmp_path):
    walk = make_walk()
    for topic, _, m in walk.messages:
        if topic == INFO and m.header.stamp.nanosec + m.header.stamp.sec * 1000 * MS > walk.stamps[3]:
            m.k = m.k.copy()
            m.k[0] = 130
    frames = list(FrameReader(walk.write(tmp_path / "walk.mcap")))
    assert [f.intrinsics.fx for f in frames] == [120, 120, 120, 120, 130, 130]


def test_depth_of_the_same_view_in_fewer_pixels_is_scaled_and_that_is_said(make_walk, tmp_path):
    walk = make_walk(2)
    for topic, _, m in walk.messages:
        if topic == DEPTH:
            small = m.data.view("<u2").reshape(120, 160)[::2, ::2]
            m.height, m.width, m.step, m.data = 60, 80, 160, np.ascontiguousarray(small).view(np.uint8).ravel()
    reader = FrameReader(walk.write(tmp_path / "walk.mcap"))
    frames = list(reader)
    assert len(frames) == 2 and frames[0].depth_m.shape == (120, 160)
    assert reader.notes == ["depth of 80x60 is scaled to colour's 160x120"]
    other = camera_info_message(walk.stamps[0], OPTICAL, walk.intrinsics)
    other.p[0] = 60  # its own camera info says: another lens
    walk.messages.append((DEPTH.replace("image_rect_raw", "camera_info"), walk.stamps[0], other))
    with_info = FrameReader(walk.write(tmp_path / "walk.mcap"))
    assert list(with_info) == [] and "two lenses" in with_info.why_nothing()


def test_the_channels_of_8uc3_are_guessed_aloud(make_walk, tmp_path):
    walk = make_walk(2)
    raw = []
    for topic, at, m in walk.messages:
        if topic == COLOR:
            bgr = cv2.imdecode(m.data, cv2.IMREAD_COLOR)
            image = make("sensor_msgs/msg/Image", header=m.header, height=120, width=160, encoding="8UC3", step=480)
            image.data = bgr.ravel()
            raw.append(("/camera/color/image_raw", at, image))
    expected = list(FrameReader(walk.write(tmp_path / "jpeg.mcap")))
    walk.messages = [m for m in walk.messages if m[0] != COLOR] + raw
    reader = FrameReader(walk.write(tmp_path / "walk.mcap"))
    np.testing.assert_array_equal([f.color for f in reader], [f.color for f in expected])
    assert any("8UC3" in note and "BGR" in note for note in reader.notes)


@pytest.mark.parametrize("encoding", ["64FC1", "mono8", "16SC1"])
def test_depth_in_an_unknown_encoding_is_still_the_depth_topic_and_its_encoding_is_named(make_walk, tmp_path, encoding):
    walk = make_walk(2)
    for i, (topic, at, m) in enumerate(walk.messages):
        if topic == DEPTH:
            m.encoding = encoding
            walk.messages[i] = ("/camera/aligned_depth_to_color/image_raw", at, m)
    reader = FrameReader(walk.write(tmp_path / "walk.mcap"))
    assert list(reader) == [] and encoding in reader.why_nothing()
    assert reader.plan.topics.color == COLOR


def test_a_cameras_name_does_not_make_its_colour_depth(make_walk, tmp_path):
    walk = make_walk(2)
    walk.messages += [("/depth_camera/color/image_raw/compressed", at, m) for t, at, m in walk.messages if t == COLOR]
    with pytest.raises(RecordingError, match=r"several colour topics \(/camera/.*, /depth_camera/"):
        list(FrameReader(walk.write(tmp_path / "walk.mcap")))
