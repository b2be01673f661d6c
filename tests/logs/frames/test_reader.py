from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from drivers.ros.convert import transforms_message
from drivers.ros.image_messages import color_message
from drivers.ros.messages import header, make
from logs.frames.reader import FrameReader, RecordingError, RecordingTopics, recording_id
from logs.mcap_io.reader import LogError
from openbelief.pose import transform

MS = 1_000_000
COLOR, DEPTH, INFO = "/camera/color/image_raw/compressed", "/camera/depth/image_rect_raw", "/camera/color/camera_info"
RECORDINGS = Path(__file__).resolve().parents[3].parent / "shared" / "recordings"


def read(walk, tmp_path, **options) -> tuple[list, FrameReader]:
    reader = FrameReader(walk.write(tmp_path / "walk.mcap"), **options)
    return list(reader), reader


def test_every_image_becomes_a_frame_posed_at_its_header_stamp(make_walk, tmp_path):
    walk = make_walk()
    frames, reader = read(walk, tmp_path)
    assert [f.stamp_ns for f in frames] == walk.stamps and [f.index for f in frames] == list(range(6))
    assert not reader.skipped and reader.damage is None
    for frame in frames:
        # 25 ms after a /tf sample: halfway to the next one; the log time would be another place
        expected = [0.1, 0.5 * (frame.stamp_ns - 1_000_000_000) / 1e9, 1.0]
        np.testing.assert_allclose(frame.T_map_camera[:3, 3], expected, atol=1e-9)
        np.testing.assert_allclose(frame.T_map_camera[:3, 2], [1, 0, 0], atol=1e-9)  # optical z looks along map x
        np.testing.assert_allclose(np.unique(frame.depth_m), [1.6, 2.0], atol=1e-6)
    assert frames[0].recording == recording_id(tmp_path / "walk.mcap")


def test_raw_colour_of_the_same_picture_gives_the_same_pixels(make_walk, tmp_path):
    walk = make_walk(2)
    color = np.random.default_rng(0).integers(0, 255, (120, 160, 3), dtype=np.uint8)
    raw = color_message(walk.stamps[0], "camera_color_optical_frame", color)
    walk.messages = [m for m in walk.messages if m[0] != COLOR]
    walk.messages.append(("/camera/color/image_raw", walk.stamps[0], raw))
    frames, _ = read(walk, tmp_path)
    np.testing.assert_array_equal(frames[0].color, color)


def test_stride_and_what_was_done_before_are_left_out_without_being_called_skipped(make_walk, tmp_path):
    walk = make_walk()
    frames, reader = read(walk, tmp_path, stride=2)
    assert [f.index for f in frames] == [0, 2, 4] and not reader.skipped
    assert [f.index for f in reader.frames(without={walk.stamps[2]})] == [0, 4]


def no_depth(walk):
    walk.drop(DEPTH, walk.stamps[2])


def depth_too_late(walk):
    late = next(m for t, _, m in walk.messages if t == DEPTH and m.header.stamp.nanosec == walk.stamps[2] % 10**9)
    late.header = header(walk.stamps[2] + 20 * MS, "camera_color_optical_frame")


def wrong_encoding(walk):
    yuv = make(
        "sensor_msgs/msg/CompressedImage",
        header=header(walk.stamps[2], "camera_color_optical_frame"),
        format="jpeg",
        data=np.zeros(100, np.uint8),
    )
    walk.replace(COLOR, walk.stamps[2], yuv)


def wrong_size(walk):
    small = np.zeros((60, 80, 3), np.uint8)
    png = np.frombuffer(cv2.imencode(".png", small)[1].tobytes(), np.uint8)
    head = header(walk.stamps[2], "camera_color_optical_frame")
    walk.replace(COLOR, walk.stamps[2], make("sensor_msgs/msg/CompressedImage", header=head, format="png", data=png))


def transforms_around(walk, keep):
    """Only the /tf messages for which keep(stamp) holds, near the third image."""
    walk.messages = [
        m for m in walk.messages if m[0] != "/tf" or keep((m[1] - MS) - walk.stamps[2])
    ]  # the writer logs /tf 1 ms after its stamp


def stale_transform(walk):
    transforms_around(walk, lambda dt: not -130 * MS < dt < 130 * MS)


def nan_transform(walk):
    T = transform([0, 0, 0], [0, 0, 0, 1])
    T[0, 3] = np.nan
    walk.messages.append(("/tf", 1, transforms_message(walk.stamps[2] + 5 * MS, [("map", "base_link", T)])))


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (no_depth, "no depth image at its stamp"),
        (depth_too_late, "no depth image at its stamp"),
        (wrong_encoding, "image is malformed"),
        (wrong_size, "sizes differ"),
        (stale_transform, "stale transform"),
        (nan_transform, "invalid transform"),
    ],
)
def test_a_frame_that_would_have_to_be_guessed_is_skipped_and_counted_by_its_reason(make_walk, tmp_path, spoil, reason):
    walk = make_walk()
    spoil(walk)
    frames, reader = read(walk, tmp_path)
    assert reader.skipped[reason] == 1 and len(reader.skips) == 1
    assert [f.index for f in frames] == [0, 1, 3, 4, 5]
    assert reader.skips[0].index == 2 and reader.skips[0].detail


def test_without_transforms_every_frame_is_skipped_and_none_is_put_at_the_origin(make_walk, tmp_path):
    walk = make_walk()
    walk.messages = [m for m in walk.messages if m[0] != "/tf"]
    frames, reader = read(walk, tmp_path)
    assert frames == [] and dict(reader.skipped) == {"no transform to the map": 6}


def test_transforms_that_end_early_leave_the_last_frames_without_a_pose(make_walk, tmp_path):
    walk = make_walk()
    transforms_around(walk, lambda dt: dt < 0)
    frames, reader = read(walk, tmp_path)
    assert len(frames) == 2 and dict(reader.skipped) == {"no transform at its stamp": 4}


def test_depth_in_another_frame_than_colour_is_refused_unless_tf_says_they_are_one(make_walk, tmp_path):
    walk = make_walk(2)
    for topic, _, message in walk.messages:
        if topic == DEPTH:
            message.header.frame_id = "camera_depth_optical_frame"
    apart = transform([0.015, 0, 0], [0, 0, 0, 1])
    optical = ("camera_color_optical_frame", "camera_depth_optical_frame")
    walk.messages.append(("/tf_static", 2, transforms_message(1, [(*optical, apart)])))
    assert dict(read(walk, tmp_path)[1].skipped) == {"depth not aligned to colour": 2}
    walk.messages[-1] = ("/tf_static", 2, transforms_message(1, [(*optical, np.eye(4))]))
    assert len(read(walk, tmp_path)[0]) == 2


def test_a_repeated_stamp_is_used_once(make_walk, tmp_path):
    walk = make_walk(2)
    again = next(m for m in walk.messages if m[0] == COLOR)
    walk.messages.append((COLOR, again[1] + 1, again[2]))
    frames, reader = read(walk, tmp_path)
    assert len(frames) == 2 and dict(reader.skipped) == {"repeated stamp": 1}


def test_several_colour_topics_must_be_named(make_walk, tmp_path):
    walk = make_walk(2)
    walk.messages += [("/rear/color/image_raw/compressed", at, m) for t, at, m in walk.messages if t == COLOR]
    with pytest.raises(RecordingError, match=r"several colour topics .*--color-topic"):
        read(walk, tmp_path)
    assert len(read(walk, tmp_path, topics=RecordingTopics(color=COLOR))[0]) == 2
    with pytest.raises(RecordingError, match=r"no colour topic '/nothing'; it has: /camera"):
        read(walk, tmp_path, topics=RecordingTopics(color="/nothing"))


@pytest.mark.parametrize(("missing", "what"), [(COLOR, "colour"), (DEPTH, "depth"), (INFO, "camera info")])
def test_a_recording_without_a_kind_of_topic_is_refused_by_name(make_walk, tmp_path, missing, what):
    walk = make_walk(2)
    walk.messages = [m for m in walk.messages if m[0] != missing]
    with pytest.raises(RecordingError, match=f"walk.mcap holds no {what} topic"):
        read(walk, tmp_path)


def test_an_empty_recording_is_refused_by_name(make_walk, tmp_path):
    walk = make_walk(0)
    walk.messages = []
    with pytest.raises(RecordingError, match="holds no colour topic"):
        read(walk, tmp_path)


def test_what_is_no_recording_is_refused_by_name(tmp_path):
    (tmp_path / "walk.mcap").write_bytes(b"hello, this is not MCAP")
    with pytest.raises(LogError, match="is not an MCAP recording"):
        list(FrameReader(tmp_path / "walk.mcap"))


def test_a_truncated_file_gives_its_complete_frames_and_says_so(make_walk, tmp_path):
    path = make_walk(12).write(tmp_path / "walk.mcap")
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    reader = FrameReader(path)
    frames = list(reader)
    assert 0 < len(frames) < 12
    assert "ends in the middle" in reader.damage


def test_a_flipped_bit_ends_the_reading_before_the_damage(make_walk, tmp_path):
    path = make_walk(12).write(tmp_path / "walk.mcap")
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 1
    path.write_bytes(data)
    reader = FrameReader(path)
    assert 0 < len(list(reader)) < 12
    assert reader.damage


@pytest.mark.recordings
def test_the_kitchen_recording_gives_all_its_frames():
    if not (RECORDINGS / "kitchen.mcap").is_file():
        pytest.skip("the shared recordings folder is not beside the checkout")
    reader = FrameReader(RECORDINGS / "kitchen.mcap", stride=20)
    frames = list(reader)
    assert len(frames) == 5 and not reader.skipped
    assert all(np.median(f.depth_m[f.depth_m > 0]) > 0.5 for f in frames)


def test_transforms_before_and_after_a_clock_was_set_back_are_never_mixed(make_walk, tmp_path):
    """The robot walks on while its clock goes back by 0.53 s: each frame is posed by what was published with it."""
    walk = make_walk(12)
    step_ns, border = 530 * MS, 1_000_000_000 + 1200 * MS
    where = {}
    for topic, _, m in walk.messages:
        heads = [t.header for t in m.transforms] if topic == "/tf" else [m.header] if hasattr(m, "header") else []
        for head in heads:
            stamp = head.stamp.sec * 1000 * MS + head.stamp.nanosec
            if topic == COLOR:
                where[stamp - (stamp >= border) * step_ns] = 0.5 * (stamp - 1_000_000_000) / 1e9
            if stamp >= border:
                head.stamp = header(stamp - step_ns, "").stamp
    frames, reader = read(walk, tmp_path)
    assert len(frames) == 12 - len(reader.skips) >= 10  # at the step itself a frame lacks a transform on one side
    for frame in frames:
        assert frame.T_map_camera[1, 3] == pytest.approx(where[frame.stamp_ns], abs=1e-6)
    assert any("set back by 0." in note for note in reader.notes)


def test_a_depth_image_may_serve_two_colour_images(make_walk, tmp_path):
    walk = make_walk(2)
    for topic, at, m in list(walk.messages):
        if topic == COLOR:
            twin = make(
                "sensor_msgs/msg/CompressedImage", header=header(0, m.header.frame_id), format=m.format, data=m.data
            )
            twin.header = header(m.header.stamp.sec * 1000 * MS + m.header.stamp.nanosec + 8 * MS, m.header.frame_id)
            walk.messages.append((topic, at + 1, twin))
    frames, _ = read(walk, tmp_path, pair_tolerance_s=0.01)
    assert len(frames) == 4
