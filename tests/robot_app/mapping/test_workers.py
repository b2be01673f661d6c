"""Frames acquired in several processes: the same memory, the same order, the same errors as with one."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from openbelief.mapping import Acquired, SegmentedFrame, map_frames
from openbelief.memory import ObjectMemory
from openbelief.observation import Intrinsics, Mask, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.store import BeliefStore
from robot_app.cli import Failure
from robot_app.mapping.workers import WAITING, FrameWorkers, jobs_for
from support.encoders import AxisEncoder

CAMERA = Intrinsics(120, 90, 100, 100, 60, 45)


def words() -> AxisEncoder:
    return AxisEncoder(lambda text: 0 if "cup" in text else 1, 2, "words")


class Eyes:
    """A cup on the left and a lamp on the right of every image, until `fails_at`."""

    id, feature_text_aligned = "eyes", True

    def __init__(self, fails_at: int | None = None) -> None:
        self.fails_at = fails_at

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        if frame.index == self.fails_at:
            raise RuntimeError("out of memory")
        left = np.zeros(frame.depth_m.shape, bool)
        left[:, :60] = True
        words = ("cup", "lamp")
        return [Mask(i, left ^ bool(i), words[i], 0.9, np.eye(2, dtype=np.float32)[i]) for i in range(2)]


def frames(count: int = 9) -> list[RgbdFrame]:
    """A walk along x whose depth tells the frames apart; the stamps are not in order."""
    rng = np.random.default_rng(0)
    walk = []
    for i in range(count):
        pose = np.eye(4)
        pose[0, 3] = 0.1 * i
        depth = rng.uniform(1.4, 1.6, (90, 120)).astype(np.float32)
        color = rng.integers(0, 255, (90, 120, 3)).astype(np.uint8)
        walk.append(RgbdFrame(i, 100 + (i * 4) % count, color, depth, CAMERA, pose, "walk"))
    return walk


def new_store(path: Path) -> BeliefStore:
    about = {"text_encoder_id": "words", "text_dim": 2, "feature_text_aligned": True, "about": {}}
    return BeliefStore.create(path, parameters=Parameters(), **about)


def looked(count: int) -> Iterator[SegmentedFrame]:
    return (SegmentedFrame(frame, [], None, False) for frame in frames(count))


def nothing(item: SegmentedFrame) -> Acquired:
    return Acquired(item.frame.recording, item.frame.stamp_ns, [], [], None, None)


def killed_at_the_third(item: SegmentedFrame) -> Acquired:
    if item.frame.index == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return nothing(item)


def wrong_at_the_third(item: SegmentedFrame) -> Acquired:
    if item.frame.index == 2:
        raise ZeroDivisionError("a defect")
    return nothing(item)


@pytest.fixture(scope="module")
def workers() -> Iterator[FrameWorkers]:
    with FrameWorkers(2, lambda seconds: None) as pool:
        yield pool


def test_the_memory_is_that_of_one_process_with_all_its_views(tmp_path: Path, workers: FrameWorkers) -> None:
    one = map_frames(frames(), Eyes(), new_store(tmp_path / "one.belief"), words())
    many = map_frames([*frames(), *frames(2)], Eyes(), new_store(tmp_path / "many.belief"), words(), each=workers.each)
    assert many.state_hash == one.state_hash
    files = [ObjectMemory.open(tmp_path / name, words()) for name in ("one.belief", "many.belief")]
    views = [[(v.key, file.surroundings.picture(v)) for v in file.surroundings.views] for file in files]
    assert views[0] == views[1] and 1 < len(views[0]) < 9
    crops = [[o.provenance.crop_jpeg for o in file.observations if o.provenance] for file in files]
    assert crops[0] == crops[1] and len(crops[0]) == 18


def test_what_perception_raises_ends_it_after_all_frames_before_are_kept(tmp_path: Path, workers: FrameWorkers) -> None:
    with new_store(tmp_path / "a.belief") as store:
        with pytest.raises(RuntimeError, match="out of memory"):
            map_frames(frames(), Eyes(fails_at=3), store, words(), each=workers.each)
        assert store.taken.frames == 3


def test_what_a_frame_raises_comes_in_its_turn(workers: FrameWorkers) -> None:
    coming = iter(workers.each(wrong_at_the_third, looked(6)))
    assert [next(coming).stamp_ns, next(coming).stamp_ns] == [frame.stamp_ns for frame in frames(6)[:2]]
    with pytest.raises(ZeroDivisionError, match="a defect"):
        next(coming)


def test_no_more_frames_are_held_than_the_workers_wait_for(workers: FrameWorkers) -> None:
    held = most = 0

    def counted() -> Iterator[SegmentedFrame]:
        nonlocal held, most
        for item in looked(20):
            held += 1
            most = max(most, held)
            yield item

    for _ in workers.each(nothing, counted()):
        held -= 1
    assert held == 0 and most == WAITING * 2


def test_a_killed_worker_is_told_in_one_line_with_what_to_do() -> None:
    with FrameWorkers(1, lambda seconds: None) as pool, pytest.raises(Failure, match="fewer --jobs"):
        list(pool.each(killed_at_the_third, looked(6)))


def test_ctrl_c_is_not_a_worker_s_to_answer(workers: FrameWorkers) -> None:
    list(workers.each(nothing, looked(2)))
    for pid in list(workers._pool._processes):
        os.kill(pid, signal.SIGINT)
    assert len(list(workers.each(nothing, looked(6)))) == 6


def test_a_short_walk_is_over_before_workers_would_have_begun() -> None:
    assert jobs_for(0) == jobs_for(200) == 1 and jobs_for(10**6) == len(os.sched_getaffinity(0))
