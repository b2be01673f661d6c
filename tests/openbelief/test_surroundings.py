from __future__ import annotations

import hashlib
import sqlite3
from dataclasses import replace

import numpy as np
import pytest

from openbelief import ObjectMemory, Parameters
from openbelief.belief_file import BeliefFile
from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.store import BeliefFileError, BeliefStore
from openbelief.surroundings import DEPTH_STEP_PX, StoreyMap, decode_depth, encode_depth, is_keyframe, view_of
from openbelief.traversability import OccupancyGrid

CAMERA = Intrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)


def frame(index=0, stamp_ns=1000, x=0.0, depth=2.0, recording="walk"):
    pose = np.eye(4)
    pose[0, 3] = x
    color = np.full((48, 64, 3), (200, 30, 30), np.uint8)
    return RgbdFrame(index, stamp_ns, color, np.full((48, 64), depth, np.float32), CAMERA, pose, recording)


def test_a_views_depth_is_kept_to_the_millimetre_and_what_is_no_measurement_is_zero():
    kept = {1.2344: 1.234, 65.535: 65.535, 65.5361: 0, -1.0: 0, np.nan: 0, np.inf: 0, -np.inf: 0, 0.0: 0}
    depth_m = np.full((DEPTH_STEP_PX, DEPTH_STEP_PX * len(kept)), 9.0, np.float32)
    depth_m[0, ::DEPTH_STEP_PX] = list(kept)
    np.testing.assert_allclose(decode_depth(encode_depth(depth_m)), [list(kept.values())], atol=1e-6)


@pytest.fixture
def site(tmp_path, flat, tiny_encoder):
    """A finished file with two keyframes and a map, and its path."""
    path = tmp_path / "site.belief"
    with _store(path, tiny_encoder) as store:
        for k in range(4):
            taken = [o for o in flat if o.frame == k]
            view = view_of(frame(k, 1000 + k, x=float(k))) if k < 2 else None
            store.add_frame("walk", 1000 + k, taken, view=view)
        store.add_map(StoreyMap("walk", OccupancyGrid(np.zeros((3, 5), np.int8), 0.05, (-1.0, 2.0), 7), 0.2))
        memory = ObjectMemory.build(store.observations(), tiny_encoder, surroundings=store.surroundings())
        store.finish(memory.evidence, memory.table.columns)
    return path


def _store(path, encoder):
    return BeliefStore.create(
        path,
        text_encoder_id=encoder.id,
        text_dim=encoder.dim,
        parameters=Parameters(),
        feature_text_aligned=True,
        about={},
    )


def test_the_file_gives_back_where_the_camera_stood_what_it_measured_and_the_map(site):
    around = ObjectMemory.open(site).surroundings
    assert [view.key for view in around.views] == [("walk", 1000), ("walk", 1001)]
    view = around.views[1]
    assert view.T_map_camera[0, 3] == 1.0 and view.intrinsics == CAMERA
    depth, camera = around.depth_m(view)
    assert depth.shape == (12, 16) == (camera.height, camera.width) and np.allclose(depth, 2.0)
    assert around.picture(view).startswith(b"\xff\xd8")
    (kept,) = around.maps
    assert (kept.height_m, kept.grid.cells.shape, kept.grid.origin_xy, kept.grid.stamp_ns) == (
        0.2,
        (3, 5),
        (-1.0, 2.0),
        7,
    )


def test_a_thinned_pixel_looks_where_its_pixel_looked():
    view, _ = view_of(frame())
    from openbelief.surroundings import thinned_camera

    u, v = np.array([0.0, 20.0, 60.0]), np.array([0.0, 8.0, 44.0])
    assert np.allclose(thinned_camera(view.intrinsics).rays(u / 4, v / 4), CAMERA.rays(u, v))


def test_surroundings_change_no_hash_and_survive_saving(site, tmp_path, flat, tiny_encoder):
    memory = ObjectMemory.open(site)
    assert memory.content_hash == ObjectMemory.build(flat, tiny_encoder).content_hash
    memory.save(tmp_path / "copy.belief")
    copy = ObjectMemory.open(tmp_path / "copy.belief").surroundings
    assert [v.key for v in copy.views] == [v.key for v in memory.surroundings.views] and len(copy.maps) == 1
    assert copy.picture(copy.views[0]) == memory.surroundings.picture(memory.surroundings.views[0])


def test_a_file_from_before_opens_and_has_no_surroundings(site):
    db = sqlite3.connect(site)
    before = ObjectMemory.open(site).content_hash
    for table in ("views", "view_images", "maps"):
        db.execute(f"DROP TABLE {table}")
    db.execute("DELETE FROM meta WHERE key IN ('surroundings_seal', 'seal')")
    from openbelief.store_rows import seal

    db.execute("INSERT INTO meta VALUES ('seal', ?)", (f'"{seal(db)}"',))
    db.commit()
    db.close()
    old = ObjectMemory.open(site)
    assert old.content_hash == before and old.surroundings.views == () and old.surroundings.maps == ()


@pytest.mark.parametrize("change", ["UPDATE views SET stamp_ns = stamp_ns + 9", "UPDATE maps SET x = 5.0"])
def test_changed_rows_are_noticed_when_they_are_read(site, change):
    with sqlite3.connect(site) as db:
        db.execute(change)
    with pytest.raises(BeliefFileError, match="do not match their seal"):
        _ = ObjectMemory.open(site).surroundings


def test_a_changed_picture_is_noticed_when_it_is_read(site):
    with sqlite3.connect(site) as db:
        db.execute("UPDATE view_images SET picture = ? WHERE stamp_ns = 1000", (b"\xff\xd8other",))
    around = BeliefFile(site).surroundings()
    around.picture(around.views[1])
    with pytest.raises(BeliefFileError, match="not what was written"):
        around.picture(around.views[0])


def test_a_camera_that_hardly_moved_gives_no_new_keyframe():
    here, turned = np.eye(4), np.eye(4)
    angle = np.deg2rad(20)
    turned[:3, :3] = [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    near, far = frame(x=0.1).T_map_camera, frame(x=0.3).T_map_camera
    assert is_keyframe(here, None) and is_keyframe(far, here) and is_keyframe(turned, here)
    assert not is_keyframe(near, here)


def test_depth_that_is_no_number_or_too_far_is_no_measurement():
    broken = frame()
    broken.depth_m[0, 0], broken.depth_m[0, 4], broken.depth_m[0, 8] = np.nan, np.inf, 70.0
    from openbelief.surroundings import decode_depth

    assert (decode_depth(view_of(replace(broken))[1].depth_png)[0, :3] == 0).all()


def test_an_unfinished_file_of_before_goes_on_with_keyframes(tmp_path, flat, tiny_encoder):
    path = tmp_path / "site.partial"
    with _store(path, tiny_encoder) as store:
        for table in ("views", "view_images", "maps"):
            store._db.execute(f"DROP TABLE {table}")
    with BeliefStore.resume(path) as store:
        store.add_frame("walk", 1000, [o for o in flat if o.frame == 0], view=view_of(frame()))
        assert len(store.surroundings().views) == 1


def test_mapping_again_gives_the_same_bytes(site):
    around = BeliefFile(site).surroundings()
    bytes_of = [around.images(view.key).depth_png + around.images(view.key).picture_jpeg for view in around.views]
    again = [view_of(frame(k, 1000 + k, x=float(k)))[1] for k in range(2)]
    assert [hashlib.sha256(b).hexdigest() for b in bytes_of] == [
        hashlib.sha256(i.depth_png + i.picture_jpeg).hexdigest() for i in again
    ]
