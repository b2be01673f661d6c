from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory
from openbelief.observation import Intrinsics, Observation, Provenance, RgbdFrame
from openbelief.surroundings import Surroundings, view_of
from openbelief.views import best_views, views_of

CAMERA = Intrinsics(160, 120, 120.0, 120.0, 79.5, 59.5)


def block(x, y, z, side=0.4):
    """(n, 3) points of the front face of a box whose middle is there; the camera looks along z."""
    u = np.linspace(-side / 2, side / 2, 12)
    return np.array([(x + a, y + b, z) for a in u for b in u], np.float32)


def looking(x=0.0, depth=6.0, things=(), stamp_ns=0):
    """A camera at (x, 0, 0) that looks along z at a wall `depth` away, and at boxes (x, y, z, side) before it."""
    pose = np.eye(4)
    pose[0, 3] = x
    depth_m = np.full((120, 160), depth, np.float32)
    for tx, ty, tz, side in sorted(things, key=lambda t: -t[2]):
        (u0, v0), (u1, v1) = (CAMERA.project(np.array([[tx - x + s, ty + s, tz]]))[0] for s in (-side / 2, side / 2))
        depth_m[max(0, round(v0)) : max(0, round(v1) + 1), max(0, round(u0)) : max(0, round(u1) + 1)] = tz
    return RgbdFrame(stamp_ns, stamp_ns, np.zeros((120, 160, 3), np.uint8), depth_m, CAMERA, pose, "walk")


def memory_of(clouds, frames, encoder, evidence_stamp=0):
    source = Provenance("walk", evidence_stamp, (0, 0, 2, 2), {"size": [4, 4], "counts": [3, 5, 8]})
    seen = [
        Observation(evidence_stamp, k, f"thing {k}", 0.9, cloud, np.eye(16, dtype=np.float32)[k], source)
        for k, cloud in enumerate(clouds)
    ]
    views = [view_of(frame) for frame in frames]
    images = {view.key: image for view, image in views}
    around = Surroundings(tuple(view for view, _ in views), (), images.__getitem__)
    return ObjectMemory.build(seen, encoder, surroundings=around)


def test_what_a_nearer_thing_hides_is_not_seen(tiny_encoder):
    near, far = (0.0, 0.0, 2.0, 1.0), (0.0, 0.0, 4.0, 0.4)
    frames = [looking(stamp_ns=1, things=[near, far]), looking(stamp_ns=2, things=[far])]
    memory = memory_of([block(0, 0, 2.0, 1.0), block(0, 0, 4.0)], frames, tiny_encoder)
    before, after = views_of(memory)
    assert before.objects == (0,)
    assert after.objects == (1,)


def test_what_is_outside_the_image_or_behind_the_camera_is_not_seen(tiny_encoder):
    aside, behind = block(9.0, 0, 2.0), block(0, 0, -2.0)
    memory = memory_of([aside, behind], [looking(stamp_ns=1)], tiny_encoder)
    assert views_of(memory)[0].objects == ()


def test_what_evidence_says_was_seen_was_seen(tiny_encoder):
    memory = memory_of([block(9.0, 0, 2.0)], [looking(stamp_ns=0)], tiny_encoder, evidence_stamp=0)
    (view,) = views_of(memory)
    assert view.objects == (0,) and view.sighting(0).box is None


def test_the_best_view_shows_most_of_it_and_largest(tiny_encoder):
    thing = (0.0, 0.0, 3.0, 0.4)
    frames = [
        looking(x=1.95, stamp_ns=1, things=[thing]),  # half of it is outside
        looking(x=0.0, stamp_ns=2, things=[thing]),
        looking(x=9.0, stamp_ns=3, things=[thing]),
    ]
    memory = memory_of([block(*thing[:3])], frames, tiny_encoder)
    views = views_of(memory)
    assert best_views(views) == {0: 1}
    box = views[1].sighting(0).box
    assert box[0] < 0.5 < box[2] and box[1] < 0.5 < box[3]


def test_one_object_may_be_asked_for_alone(tiny_encoder):
    things = [(0.0, 0.0, 3.0, 0.4), (0.8, 0.0, 3.0, 0.4)]
    memory = memory_of([block(*t[:3]) for t in things], [looking(stamp_ns=1, things=things)], tiny_encoder)
    assert views_of(memory)[0].objects == (0, 1)
    assert views_of(memory, [memory.objects[1]])[0].objects == (1,)


def test_a_file_from_before_gives_the_frames_of_its_evidence_without_poses(flat, tiny_encoder):
    views = views_of(ObjectMemory.build(flat, tiny_encoder))
    assert [view.objects for view in views] == [(0, 1, 2, 3)] * 4
    assert all(view.T_map_camera is None for view in views)


@pytest.mark.parametrize("lost", [0.0, np.nan])
def test_where_nothing_was_measured_nothing_is_seen(tiny_encoder, lost):
    frame = looking(stamp_ns=1)
    frame.depth_m[:] = lost
    memory = memory_of([block(0, 0, 3.0)], [frame], tiny_encoder)
    assert views_of(memory)[0].objects == ()
