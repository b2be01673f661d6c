"""Back-projection and voxel snapping."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from openbelief.backprojection import backproject, distinct_points, occupied_voxels, snap
from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.pose import transform

CAMERA = Intrinsics(8, 6, 10.0, 10.0, 3.5, 2.5)


def frame(depth: np.ndarray, T: np.ndarray | None = None) -> RgbdFrame:
    color = np.zeros((6, 8, 3), np.uint8)
    return RgbdFrame(0, 0, color, depth.astype(np.float32), CAMERA, np.eye(4) if T is None else T)


def test_a_point_projects_back_onto_its_pixel_in_the_map_frame() -> None:
    T = transform([1.0, -2.0, 0.5], [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)])
    pixels = np.zeros((6, 8), bool)
    pixels[4, 6] = True
    point = backproject(pixels, frame(np.full((6, 8), 2.0), T), Parameters())
    np.testing.assert_allclose(point, [[1.0 - 0.3, -2.0 + 0.5, 2.5]], atol=1e-6)  # (0.5, 0.3, 2) turned by 90 deg
    assert point.dtype == np.float32


@pytest.mark.parametrize("bad", [0.0, np.nan, np.inf, -1.0, 0.05, 6.5])
def test_what_is_no_measurement_makes_no_point(bad: float) -> None:
    depth = np.full((6, 8), 1.0)
    depth[2:] = bad
    assert len(backproject(np.ones((6, 8), bool), frame(depth), Parameters())) == 16
    assert backproject(np.ones((6, 8), bool), frame(np.full((6, 8), bad)), Parameters()).shape == (0, 3)


def test_an_empty_mask_gives_no_points_and_a_misshapen_one_is_refused() -> None:
    assert backproject(np.zeros((6, 8), bool), frame(np.ones((6, 8))), Parameters()).shape == (0, 3)
    with pytest.raises(ValueError, match="Shape of pixels"):
        backproject(np.ones((8, 6), bool), frame(np.ones((6, 8))), Parameters())


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**31), st.integers(1, 200), st.sampled_from([0.02, 0.05, 0.1]))
def test_snapping_keeps_one_point_per_voxel_and_is_idempotent(seed: int, n: int, voxel: float) -> None:
    points = np.random.default_rng(seed).uniform(-3, 3, (n, 3)).astype(np.float32)
    snapped = snap(points, voxel)
    np.testing.assert_array_equal(snap(snapped, voxel), snapped)
    np.testing.assert_array_equal(snap(points[::-1], voxel), snapped)
    gaps = np.abs(points[:, None] - snapped[None]).max(axis=2).min(axis=1)
    assert gaps.max() <= voxel / 2 + 1e-5
    assert len(snapped) == len(np.unique(np.floor(points.astype(float) / voxel), axis=0))


def test_snapping_nothing_gives_nothing() -> None:
    assert snap(np.zeros((0, 3)), 0.02).shape == (0, 3)


@given(st.integers(0, 2**32 - 1), st.integers(1, 300), st.sampled_from([0.02, 0.05]), st.floats(-50.0, 1e6))
@settings(max_examples=60, deadline=None)
def test_distinct_points_are_the_distinct_rows_of_snapped_and_of_raw_clouds(
    seed: int, n: int, voxel: float, away: float
) -> None:
    rng = np.random.default_rng(seed)
    raw = (rng.uniform(-0.1, 0.1, (n, 3)) + away).astype(np.float32)
    for cloud in (raw, snap(raw, voxel), np.concatenate((snap(raw, voxel), raw[:1]))):
        repeated = cloud[rng.integers(0, len(cloud), 2 * len(cloud))]
        np.testing.assert_array_equal(distinct_points(repeated, voxel), np.unique(repeated, axis=0))


@given(st.integers(0, 2**32 - 1), st.integers(1, 300), st.sampled_from([0.02, 0.05, 1e-5]), st.floats(-1e3, 1e3))
@settings(max_examples=60, deadline=None)
def test_voxels_and_their_points_are_those_of_every_point_however_it_lies_in_memory(
    seed: int, n: int, voxel: float, away: float
) -> None:
    points = (np.random.default_rng(seed).uniform(-0.2, 0.2, (n, 3)) + away).astype(np.float32)
    whole, counts = np.unique(np.floor(points.astype(np.float64) / voxel).astype(np.int64), axis=0, return_counts=True)
    centres = ((whole + 0.5) * voxel).astype(np.float32)
    chosen = np.arange(len(whole)) % 3 > 0
    for laid in (points, np.asfortranarray(points), points[::-1]):
        voxels = occupied_voxels(laid, voxel)
        np.testing.assert_array_equal(voxels.steps.T + voxels.low, whole)
        np.testing.assert_array_equal(voxels.counts, counts)
        np.testing.assert_array_equal(voxels.centres(), centres)
        np.testing.assert_array_equal(voxels.centres(chosen), centres[chosen])
