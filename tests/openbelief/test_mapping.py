from __future__ import annotations

from contextlib import contextmanager

import numpy as np
import pytest

from openbelief.mapping import STAGES, build_memory, map_frames, take_evidence
from openbelief.memory import ObjectMemory
from openbelief.observation import Intrinsics, Mask, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.store import BeliefStore


class Words:
    """A text encoder that knows two words."""

    id, dim = "words", 2

    def encode(self, texts):
        return np.array([[1, 0] if "cup" in text else [0, 1] for text in texts], np.float32)


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
    memory = map_frames(frames(), Eyes(), new_store(tmp_path / "a.belief"), Words())
    assert sorted(node.concepts[0].label for node in memory.objects) == ["cup", "lamp"]
    assert ObjectMemory.open(tmp_path / "a.belief", Words()).content_hash == memory.content_hash
    assert [f.stamp_ns for f in memory.frames] == [100, 101, 102, 103]


def test_every_step_is_timed_by_its_name_and_every_frame_told(tmp_path):
    entered, told = [], []

    @contextmanager
    def stage(name):
        entered.append(name)
        yield

    store = new_store(tmp_path / "a.belief")
    taken = take_evidence(frames(2), Eyes(), store, stage=stage, on_frame=lambda t: told.append(t.frames))
    build_memory(store, Words(), stage=stage)
    assert entered == [*STAGES[:3], *STAGES[:3], *STAGES[3:]]
    assert told == [1, 2] and (taken.masks, taken.observations) == (4, 4)


def test_an_interrupted_mapping_goes_on_where_it_stopped_and_ends_the_same(tmp_path):
    whole = map_frames(frames(), Eyes(), new_store(tmp_path / "whole.belief"), Words())
    eyes = Eyes()
    with new_store(tmp_path / "part.belief") as store:
        take_evidence(frames()[:2], eyes, store)
    resumed = map_frames(frames(), eyes, BeliefStore.resume(tmp_path / "part.belief"), Words())
    assert eyes.asked == [100, 101, 102, 103]
    assert resumed.content_hash == whole.content_hash


def test_refused_masks_are_counted_and_a_failing_perception_is_not_swallowed(tmp_path):
    class Small(Eyes):
        def perceive(self, frame):
            return [Mask(0, np.eye(90, 120, dtype=bool), "dust", 0.5, np.array([1, 0], np.float32))]

    class Broken(Eyes):
        def perceive(self, frame):
            raise RuntimeError("out of memory")

    with new_store(tmp_path / "a.belief") as store:
        assert take_evidence(frames(3), Small(), store).refused == {"mask smaller than 100 pixels": 3}
    with new_store(tmp_path / "b.belief") as store, pytest.raises(RuntimeError, match="out of memory"):
        take_evidence(frames(3), Broken(), store)
