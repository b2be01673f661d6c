from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from openbelief.g1 import COLOR_INTRINSICS, T_BASE_CAMERA
from openbelief.observation import RgbdFrame
from openbelief.perception.ports import FrameUnseen, Perception
from openbelief.pose import Pose2
from sim_fakes.world.mask_noise import MaskNoise, ragged_masks
from sim_fakes.world.renderer import Renderer
from sim_fakes.world.scene import Vocabulary
from sim_fakes.world.scripted_perception import ScriptedPerception, phrase

FAR, NEAR = Pose2(0.6, 1.3, 0.1), Pose2(1.5, 1.2, 0.2)


@pytest.fixture
def renderer(small_world):
    return Renderer(small_world)


def frame(renderer, pose, stamp_ns):
    T = pose.matrix() @ T_BASE_CAMERA
    depth_m, _ = renderer.segment(T, COLOR_INTRINSICS)
    return RgbdFrame(0, stamp_ns, np.zeros((*depth_m.shape, 3), np.uint8), depth_m, COLOR_INTRINSICS, T)


def said(masks):
    """What can be compared of a frame's masks."""
    return [(m.index, m.phrase, m.confidence, m.pixels.tobytes(), m.feature.tobytes()) for m in masks]


def of_object(masks, instances, object_id):
    return [m for m in masks if (instances[m.pixels] == object_id).mean() > 0.7]


def test_a_frame_of_another_place_is_not_looked_at(small_world, encoder, renderer):
    elsewhere = frame(renderer, FAR, 1)
    moved = replace(elsewhere, depth_m=np.where(elsewhere.depth_m > 0, elsewhere.depth_m + 1.0, 0).astype(np.float32))
    with pytest.raises(FrameUnseen, match="another place than the scene"):
        ScriptedPerception(small_world, encoder, renderer=renderer).perceive(moved)


def test_the_same_frame_gives_the_same_masks_in_any_order(small_world, encoder, renderer):
    frames = [frame(renderer, FAR, stamp) for stamp in (1, 2, 3)]
    forward = ScriptedPerception(small_world, encoder, seed=4, renderer=renderer)
    backward = ScriptedPerception(small_world, encoder, seed=4, renderer=renderer)
    there = [said(forward.perceive(f)) for f in frames]
    back = [said(backward.perceive(f)) for f in reversed(frames)][::-1]
    assert isinstance(forward, Perception)
    assert there == back
    assert there[0] != there[1]


def test_another_seed_sees_otherwise_and_is_named_otherwise(small_world, encoder, renderer):
    one, two = (ScriptedPerception(small_world, encoder, seed=s, renderer=renderer) for s in (1, 2))
    assert said(one.perceive(frame(renderer, FAR, 1))) != said(two.perceive(frame(renderer, FAR, 1)))
    assert one.id != two.id
    assert small_world.hash in one.id


def test_views_of_one_thing_look_alike_and_a_little_like_its_name(small_world, encoder, renderer):
    perception = ScriptedPerception(small_world, encoder, seed=0, renderer=renderer)
    _, instances = renderer.segment(FAR.matrix() @ T_BASE_CAMERA, COLOR_INTRINSICS)
    vase, box = [], []
    for stamp in range(12):
        masks = perception.perceive(frame(renderer, FAR, stamp))
        vase += [m.feature for m in of_object(masks, instances, 100)]
        box += [m.feature for m in of_object(masks, instances, 101)]
    vases, boxes = np.array(vase), np.array(box)
    assert len(vases) >= 8
    assert np.median(vases @ vases.T) >= 0.85
    assert np.abs(vases @ boxes.T).max() < 0.6
    assert (vases @ encoder.encode(["vase"])[0]).mean() == pytest.approx(0.29, abs=0.05)


def test_the_wrong_name_is_given_as_often_as_the_scene_says_and_only_from_far(small_world):
    spec = small_world.object(100).spec
    rng = np.random.default_rng(0)
    far = Counter(phrase(spec, Vocabulary(), 1.0, rng) for _ in range(3000))
    near = Counter(phrase(spec, Vocabulary(), 0.0, rng) for _ in range(500))
    assert far["hydrant"] / 3000 == pytest.approx(0.7, abs=0.03)
    assert set(far) == {"hydrant", "red vase"}
    assert set(near) == {"vase", "red vase"}


def test_distance_decides_which_names_are_used(small_world, encoder, renderer):
    perception = ScriptedPerception(small_world, encoder, seed=0, renderer=renderer)
    names = {}
    for pose in (FAR, NEAR):
        _, instances = renderer.segment(pose.matrix() @ T_BASE_CAMERA, COLOR_INTRINSICS)
        seen = [of_object(perception.perceive(frame(renderer, pose, s)), instances, 100) for s in range(15)]
        names[pose] = Counter(m.phrase for masks in seen for m in masks)
    assert names[FAR]["hydrant"] >= 0.4 * names[FAR].total()
    assert names[NEAR]["hydrant"] == 0
    assert names[NEAR]["vase"] >= 0.6 * names[NEAR].total()


def test_masks_are_ragged_and_now_and_then_missing_split_or_doubled():
    silhouette = np.zeros((240, 320), bool)
    silhouette[80:180, 100:220] = True
    counts, overlaps = Counter(), []
    for seed in range(300):
        masks = ragged_masks(silhouette, MaskNoise(), np.random.default_rng(seed))
        counts[len(masks)] += 1
        if len(masks) == 1:
            overlaps.append((masks[0] & silhouette).sum() / (masks[0] | silhouette).sum())
    assert counts[0] / 300 == pytest.approx(0.06, abs=0.04)
    assert counts[2] / 300 == pytest.approx(0.10, abs=0.05)
    assert 0.8 < np.median(overlaps) < 0.995
    assert max(overlaps) < 1.0


def test_what_is_too_small_is_not_segmented():
    silhouette = np.zeros((240, 320), bool)
    silhouette[:10, :10] = True
    assert ragged_masks(silhouette, MaskNoise(), np.random.default_rng(0)) == []
