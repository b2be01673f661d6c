"""Files that one recording was split into share transforms, calibrations and the pictures at their borders."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from logs.frames.reader import FrameReader, ReadOptions, frame_readers

COLOR = "/camera/color/image_raw/compressed"
MS = 1_000_000


def split(walk, folder: Path, border_ns: int, names=("walk_0.mcap", "walk_1.mcap")) -> list[Path]:
    messages = walk.messages
    parts = [m for m in messages if m[1] < border_ns], [m for m in messages if m[1] >= border_ns]
    paths = []
    for name, part in zip(names, parts, strict=True):
        walk.messages = part
        paths.append(walk.write(folder / name))
    walk.messages = messages
    return paths


@pytest.mark.parametrize("names", [("walk_0.mcap", "walk_1.mcap"), ("walk.mcap", "walk_001.mcap")])
@pytest.mark.parametrize("after_ms", [0, 10, 25, 30])
@pytest.mark.parametrize("turned", [False, True])
def test_no_frame_is_lost_wherever_the_border_lies(make_walk, tmp_path, names, after_ms, turned):
    """Just after an image's stamp: its depth, its calibration or the next transform may be in the other file."""
    walk = make_walk(6)
    whole = list(FrameReader(walk.write(tmp_path / "whole.mcap")))
    paths = split(walk, tmp_path, walk.stamps[3] + after_ms * MS, names)
    readers = frame_readers(paths[::-1] if turned else paths, ReadOptions())
    frames = sorted((f for reader in readers for f in reader), key=lambda f: f.stamp_ns)
    assert [f.stamp_ns for f in frames] == walk.stamps
    assert not any(reader.skipped for reader in readers)
    for ours, theirs in zip(frames, whole, strict=True):
        np.testing.assert_array_equal(ours.depth_m, theirs.depth_m)
        np.testing.assert_allclose(ours.T_map_camera, theirs.T_map_camera)


def test_each_file_keeps_its_own_id_and_order(make_walk, tmp_path):
    paths = split(make_walk(6), tmp_path, 2_000_000_000)
    together = frame_readers(paths, ReadOptions())
    assert [r.recording for r in together] == [FrameReader(path).recording for path in paths]
    assert [f.index for f in together[1]] == list(range(len(together[1].plan.frames)))


def test_walks_of_two_days_share_nothing_whatever_their_names(make_walk, tmp_path):
    today, tomorrow = make_walk(3), make_walk(3)
    tomorrow.messages = [(t, at + 86_400_000 * MS, m) for t, at, m in tomorrow.messages if t != "/tf_static"]
    paths = [today.write(tmp_path / "walk_0.mcap"), tomorrow.write(tmp_path / "walk_1.mcap")]
    assert [len(list(reader)) for reader in frame_readers(paths, ReadOptions())] == [3, 0]
