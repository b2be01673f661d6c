"""A recording is what it holds, not how it is packed: every container gives the same frames."""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path

import numpy as np
import pytest
import zstandard

from drivers.ros.messages import encode
from logs.containers import zstd
from logs.containers.recording import Recording, recording_id
from logs.containers.ros1 import ros2_name
from logs.frames.reader import FrameReader, RecordingError
from logs.mcap_io.reader import LogError


def mcap(walk, folder, write):
    return walk.write(folder / "walk.mcap")


def mcap_zstd(walk, folder, write):
    return write.zstd(walk.write(folder / "walk.mcap"))


def sqlite(walk, folder, write):
    return write.sqlite(walk, folder / "walk.db3")


def sqlite_zstd(walk, folder, write):
    return write.zstd(write.sqlite(walk, folder / "walk.db3"))


def bag(walk, folder, write):
    return write.ros1(walk, folder / "walk.bag")


def bag_bz2(walk, folder, write):
    return write.ros1(walk, folder / "walk.bag", "bz2")


def bag_lz4(walk, folder, write):
    return write.ros1(walk, folder / "walk.bag", "lz4")


def message_compression(walk, folder, write):
    """rosbag2's --compression-mode message: each payload is a zstd frame."""
    packed = [(t, at, Packed(m)) for t, at, m in walk.messages]
    whole = walk.messages
    walk.messages = packed
    path = walk.write(folder / "walk.mcap")
    walk.messages = whole
    return path


def folder_of_mcap(walk, folder, write):
    return split(walk, folder / "walk", lambda part, name: part.write(name.with_suffix(".mcap")))


def folder_of_sqlite(walk, folder, write):
    return split(walk, folder / "walk", lambda part, name: write.sqlite(part, name.with_suffix(".db3")))


def folder_of_packed(walk, folder, write):
    """metadata.yaml names the files without the ending that compression gave them."""
    return split(walk, folder / "walk", lambda part, name: pack(write, part.write(name.with_suffix(".mcap"))))


def pack(write, path):
    packed = write.zstd(path)
    path.unlink()
    return packed


class Packed(bytes):
    """A message's bytes, compressed, that still says its type."""

    def __new__(cls, message):
        packed = super().__new__(cls, zstandard.ZstdCompressor().compress(encode(message)))
        packed.__msgtype__ = message.__msgtype__
        return packed


def split(walk, folder, write_part, metadata=True):
    """The folder that `ros2 bag record --max-bag-duration` makes: every message once, /tf_static in the first file."""
    folder.mkdir()
    messages = sorted(walk.messages, key=lambda m: m[1])
    middle = messages[len(messages) // 2][1]
    halves = [m for m in messages if m[1] < middle], [m for m in messages if m[1] >= middle]
    names = []
    for number, half in enumerate(halves):
        walk.messages = half
        names.append(write_part(walk, folder / f"walk_{number}").name.removesuffix(".zstd"))
    walk.messages = messages
    if metadata:
        listed = "".join(f"    - {name}\n" for name in names)
        head = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n"
        (folder / "metadata.yaml").write_text(f"{head}{listed}  duration:\n    nanoseconds: 1\n")
    return folder


CONTAINERS = [
    mcap,
    mcap_zstd,
    message_compression,
    sqlite,
    sqlite_zstd,
    bag,
    bag_bz2,
    bag_lz4,
    folder_of_mcap,
    folder_of_sqlite,
    folder_of_packed,
]


@pytest.mark.parametrize("pack", CONTAINERS)
def test_every_container_gives_the_same_frames(make_walk, tmp_path, write, pack):
    walk = make_walk(6)
    (tmp_path / "plain").mkdir()
    expected = list(FrameReader(mcap(walk, tmp_path / "plain", write)))
    reader = FrameReader(pack(walk, tmp_path, write))
    frames = list(reader)
    assert [f.stamp_ns for f in frames] == walk.stamps and not reader.skipped and reader.damage is None
    for ours, theirs in zip(frames, expected, strict=True):
        np.testing.assert_array_equal(ours.color, theirs.color)
        np.testing.assert_array_equal(ours.depth_m, theirs.depth_m)
        np.testing.assert_allclose(ours.T_map_camera, theirs.T_map_camera)


def test_a_folder_without_metadata_is_its_numbered_files(make_walk, tmp_path, write):
    folder = split(make_walk(6), tmp_path / "walk", lambda part, n: part.write(n.with_suffix(".mcap")), metadata=False)
    assert len(list(FrameReader(folder))) == 6


def test_a_folder_of_several_recordings_and_one_of_none_are_refused(make_walk, tmp_path):
    walk = make_walk(2)
    walk.write(tmp_path / "monday.mcap")
    walk.write(tmp_path / "tuesday.mcap")
    with pytest.raises(LogError, match=r"folder of several recordings \(monday.mcap, tuesday.mcap\).*\.mcap files"):
        Recording(tmp_path).require()
    (tmp_path / "empty").mkdir()
    with pytest.raises(LogError, match="folder without a recording"):
        Recording(tmp_path / "empty").require()


def test_a_part_that_metadata_lists_and_nobody_finds_is_told(make_walk, tmp_path, write):
    folder = folder_of_mcap(make_walk(6), tmp_path, write)
    (folder / "walk_1.mcap").unlink()
    reader = FrameReader(folder)
    assert 0 < len(list(reader)) < 6 and "walk_1.mcap is listed" in str(reader.damage)


def test_a_folders_id_is_the_same_wherever_it_lies(make_walk, tmp_path, write):
    folder = folder_of_mcap(make_walk(4), tmp_path, write)
    before = recording_id(folder)
    (tmp_path / "elsewhere").mkdir()
    assert recording_id(folder.rename(tmp_path / "elsewhere" / "walk")) == before


def test_metadata_does_not_lead_out_of_its_folder(make_walk, tmp_path, write):
    make_walk(2).write(tmp_path / "other_0.mcap")
    folder = folder_of_mcap(make_walk(4), tmp_path, write)
    (folder / "metadata.yaml").write_text("relative_file_paths:\n  - ../other_0.mcap\n  - walk_0.mcap\n")
    assert [part.path.name for part in Recording(folder).parts] == ["walk_0.mcap"]


def test_ros_1s_names_of_types_become_ros_2s():
    assert ros2_name("sensor_msgs/Image") == "sensor_msgs/msg/Image" == ros2_name("sensor_msgs/msg/Image")
    assert ros2_name("tf/tfMessage") == "tf2_msgs/msg/TFMessage"  # before tf2


@pytest.mark.parametrize("share", [0.3, 0.7])
@pytest.mark.parametrize("pack", [mcap, sqlite, bag, bag_bz2])
def test_what_was_cut_short_gives_what_lies_before_and_says_so(make_walk, tmp_path, write, pack, share):
    path = pack(make_walk(12), tmp_path, write)
    os.truncate(path, int(path.stat().st_size * share))
    recording = Recording(path)
    assert len(list(recording)) < len(make_walk(12).messages) and recording.damage


def test_a_packed_file_cut_short_gives_what_expands_and_says_so(make_walk, tmp_path):
    walk, path = make_walk(60), tmp_path / "walk.mcap.zstd"
    plain = walk.write(tmp_path / "walk.mcap").read_bytes()
    frames = [zstandard.ZstdCompressor().compress(plain[i : i + 50_000]) for i in range(0, len(plain), 50_000)]
    path.write_bytes(b"".join(frames))  # as pzstd writes it: one frame after the other
    assert len(list(Recording(path))) == len(walk.messages)
    path.write_bytes(b"".join(frames)[:-1000])
    recording = Recording(path)
    assert 0 < len(list(recording)) < len(walk.messages) and "breaks off" in str(recording.damage)
    path.write_bytes(frames[0][:500])
    with pytest.raises(LogError, match=r"in the middle|not whole zstd"):
        Recording(path).require()


@pytest.mark.parametrize("pack", [sqlite, bag, mcap])
def test_bytes_that_were_changed_are_damage_or_other_data_never_an_exception(make_walk, tmp_path, write, pack):
    path = pack(make_walk(2), tmp_path, write)
    good, rng = path.read_bytes(), np.random.default_rng(3)
    for _ in range(60):
        bad = bytearray(good)
        for at in rng.integers(16, len(bad), 20):
            bad[at] ^= int(rng.integers(1, 256))
        path.write_bytes(bad)
        try:
            list(Recording(path))
            list(FrameReader(path))
        except (LogError, RecordingError):
            continue


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (b"\x1f\x8b\x08\x00", "gzip: gunzip"),
        (b"PK\x03\x04", "unpack it first"),
        (b"version https://git-lfs.github.com/spec/v1", "git lfs pull"),
        (b"BZh9", "bunzip2"),
        (b"hello", "is not an MCAP recording"),
        (b"", "is not an MCAP recording"),
    ],
)
def test_a_file_that_is_something_else_is_named_for_what_it_is(tmp_path, head, words):
    (tmp_path / "walk.mcap").write_bytes(head + bytes(100) if head else b"")
    with pytest.raises(LogError, match=words):
        Recording(tmp_path / "walk.mcap").require()


def test_a_database_that_is_no_bag_and_one_that_computes_are_refused(tmp_path):
    for name, statement in (
        ("notes", "CREATE TABLE notes(text TEXT)"),
        (
            "views",
            "CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i FROM n) SELECT i FROM n",
        ),
    ):
        path = tmp_path / f"{name}.db3"
        with sqlite3.connect(path) as db:
            db.execute(statement)
        db.close()
        with pytest.raises(LogError, match="no rosbag2"):
            list(Recording(path))


def test_a_database_whose_recorder_was_killed_is_read_with_its_log(make_walk, tmp_path, write):
    path = write.sqlite(make_walk(3), tmp_path / "walk.db3")
    db = sqlite3.connect(path)
    db.execute("PRAGMA journal_mode=WAL")
    db.execute("INSERT INTO messages(topic_id,timestamp,data) SELECT topic_id,timestamp,data FROM messages LIMIT 1")
    db.commit()
    assert Path(f"{path}-wal").stat().st_size
    assert len(list(Recording(path))) == len(make_walk(3).messages) + 1
    db.close()


def test_a_file_that_expands_without_end_is_refused_and_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(zstd, "BOMB_BYTES", 1 << 20)
    monkeypatch.setattr(zstd, "BOMB_RATIO", 1)
    monkeypatch.setenv("TMPDIR", str(tmp_path / "scratch"))
    monkeypatch.setattr(zstd.tempfile, "tempdir", None)
    (tmp_path / "scratch").mkdir()
    bomb = tmp_path / "walk.mcap.zstd"
    bomb.write_bytes(zstandard.ZstdCompressor().compress(bytes(32 << 20)))
    with pytest.raises(LogError, match="expands to more than"):
        Recording(bomb).require()
    assert not list((tmp_path / "scratch").iterdir())


def test_a_message_that_expands_without_end_is_not_read(make_walk, tmp_path, write, monkeypatch):
    monkeypatch.setattr(zstd, "MAX_MESSAGE_BYTES", 1000)
    reader = FrameReader(message_compression(make_walk(2), tmp_path, write))
    with pytest.raises(RecordingError, match="compression does not expand"):
        list(reader)
