from __future__ import annotations

import numpy as np
import pytest

from openbelief.mapping import map_frames
from openbelief.memory import ObjectMemory
from openbelief.observation import Intrinsics, Mask, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.perception.ports import FrameUnseen
from openbelief.store import BeliefStore
from support.encoders import AxisEncoder


def words() -> AxisEncoder:
    """A text encoder that knows two words."""
    return AxisEncoder(lambda text: 0 if "cup" in text else 1, 2, "words")


class Eyes:
    """A cup on the left and a lamp on the right of every image."""

    id, feature_text_aligned = "eyes", True

    def __init__(self):
        self.asked = []

    def perceive(self, frame):
        self.asked.append(frame.stamp_ns)
        left = np.zeros(frame.depth_m.shape, bool)
        left[:, :60] = True
        words = ("cup", "lamp")
        return [Mask(i, left ^ bool(i), words[i], 0.9, np.eye(2, dtype=np.float32)[i]) for i in range(2)]


def frames(count=4):
    camera = Intrinsics(120, 90, 100, 100, 60, 45)
    color, depth = np.zeros((90, 120, 3), np.uint8), np.full((90, 120), 1.5, np.float32)
    return [RgbdFrame(i, 100 + i, color, depth, camera, np.eye(4), "walk") for i in range(count)]


def new_store(path) -> BeliefStore:
    about = {"text_encoder_id": "words", "text_dim": 2, "feature_text_aligned": True, "about": {}}
    return BeliefStore.create(path, parameters=Parameters(), **about)


def test_frames_become_a_sealed_memory_of_the_things_in_them(tmp_path):
    memory = map_frames(frames(), Eyes(), new_store(tmp_path / "a.belief"), words())
    assert sorted(node.concepts[0].label for node in memory.objects) == ["cup", "lamp"]
    assert ObjectMemory.open(tmp_path / "a.belief", words()).content_hash == memory.content_hash
    assert [f.stamp_ns for f in memory.frames] == [100, 101, 102, 103]


def test_an_interrupted_mapping_goes_on_where_it_stopped_and_ends_the_same(tmp_path):
    def cut_short():
        yield from frames()[:2]
        raise KeyboardInterrupt

    whole = map_frames(frames(), Eyes(), new_store(tmp_path / "whole.belief"), words())
    eyes = Eyes()
    with new_store(tmp_path / "part.belief") as store, pytest.raises(KeyboardInterrupt):
        map_frames(cut_short(), eyes, store, words())
    with BeliefStore.resume(tmp_path / "part.belief") as store:
        assert store.taken.frames == 2 and store.taken.masks == store.taken.observations == 4
        resumed = map_frames(frames(), eyes, store, words())
    assert eyes.asked == [100, 101, 102, 103]
    assert resumed.content_hash == whole.content_hash


def test_a_frame_that_cannot_be_looked_at_is_kept_with_the_reason_and_not_tried_again(tmp_path):
    class Blinking(Eyes):
        def perceive(self, frame):
            masks = super().perceive(frame)
            if frame.stamp_ns == 101:
                raise FrameUnseen("the lens was covered")
            return masks

    eyes = Blinking()
    with new_store(tmp_path / "a.belief") as store:
        memory = map_frames([*frames(3), *frames(3)], eyes, store, words())
        assert store.taken.unseen == {"the lens was covered": 1} and store.taken.frames == 3
    assert [f.skipped for f in memory.frames] == [None, "the lens was covered", None]
    assert eyes.asked == [100, 101, 102]


def test_what_a_reader_left_out_is_told_again_by_every_run_and_written_with_the_seal(tmp_path):
    with new_store(tmp_path / "a.belief") as store:
        store.leave_out("walk", 99, "no depth image")
    with BeliefStore.resume(tmp_path / "a.belief") as store:
        assert not store.holds("walk", 99) and store.frames() == ()
        store.leave_out("walk", 99, "no depth image")
        map_frames(frames(2), Eyes(), store, words())
    kept = ObjectMemory.open(tmp_path / "a.belief").frames
    assert [(f.stamp_ns, f.skipped) for f in kept] == [(99, "no depth image"), (100, None), (101, None)]


def test_refused_masks_are_counted_and_a_failing_perception_is_not_swallowed(tmp_path):
    class Small(Eyes):
        def perceive(self, frame):
            return [Mask(0, np.eye(90, 120, dtype=bool), "dust", 0.5, np.array([1, 0], np.float32))]

    class Broken(Eyes):
        def perceive(self, frame):
            raise RuntimeError("out of memory")

    with new_store(tmp_path / "a.belief") as store:
        map_frames(frames(3), Small(), store, words())
        assert store.taken.refused == {"mask smaller than 100 pixels": 3} and store.taken.observations == 0
    with new_store(tmp_path / "b.belief") as store, pytest.raises(RuntimeError, match="out of memory"):
        map_frames(frames(3), Broken(), store, words())
