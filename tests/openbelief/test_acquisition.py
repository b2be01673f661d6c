from __future__ import annotations

import cv2
import numpy as np
import pytest

from openbelief.acquisition import CROP_MAX_PX, acquire
from openbelief.observation import Intrinsics, Mask, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.pose import apply, quaternion_from_rpy, transform
from openbelief.run_lengths import decode_rle

PARAMETERS = Parameters()
FEATURE = np.array([1, 0, 0, 0], np.float32)
T = transform([1.0, -2.0, 1.2], quaternion_from_rpy(-2.0, 0.1, 0.4))


def frame(depth_m, *, distortion=(), color=None) -> RgbdFrame:
    h, w = depth_m.shape
    camera = Intrinsics(w, h, 200.0, 210.0, w / 2 - 3.5, h / 2 + 1.5, distortion)
    color = np.zeros((h, w, 3), np.uint8) if color is None else color
    return RgbdFrame(7, 123, color, depth_m.astype(np.float32), camera, T, "walk")


def mask(pixels, *, index=0, phrase="cup", confidence=0.8) -> Mask:
    return Mask(index, pixels, phrase, confidence, FEATURE)


def rectangle(shape, rows, columns):
    pixels = np.zeros(shape, bool)
    pixels[rows, columns] = True
    return pixels


@pytest.mark.parametrize("distortion", [(), (0.12, -0.25, 0.001, -0.002, 0.08)])
def test_points_lie_where_opencv_says_the_pixels_came_from(distortion):
    camera = frame(np.zeros((240, 320)), distortion=distortion).intrinsics
    # Truth from the other direction: 3-D points on a plane, projected by OpenCV to the pixels they would be seen at.
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 60), np.linspace(-0.2, 0.2, 60))
    surface = np.column_stack((x.ravel(), y.ravel(), np.full(x.size, 1.5)))
    k = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    seen, _ = cv2.projectPoints(surface, np.zeros(3), np.zeros(3), k, np.array(distortion or [0.0] * 4))
    u, v = np.rint(seen[:, 0]).astype(int).T
    depth = np.zeros((240, 320))
    depth[v, u] = 1.5
    [made], refused = acquire(frame(depth, distortion=distortion), [mask(depth > 0)], PARAMETERS)
    truth = apply(T, surface)
    distance = np.linalg.norm(made.points[:, None] - truth[None], axis=2).min(axis=1)
    assert not refused
    assert distance.max() < 0.5 * np.sqrt(3) * PARAMETERS.voxel_m + 0.006  # half a voxel's diagonal, half a pixel
    corners = [np.linalg.norm(made.points - corner, axis=1).min() for corner in truth[[0, 59, -60, -1]]]
    assert max(corners) < 0.025


def test_an_observation_has_one_point_per_occupied_voxel_whatever_the_resolution():
    sizes = []
    for scale in (1, 2):
        depth = np.full((120 * scale, 160 * scale), 1.2)
        whole = frame(depth)
        camera = Intrinsics(160 * scale, 120 * scale, 150.0 * scale, 150.0 * scale, 80.0 * scale, 60.0 * scale)
        scaled = RgbdFrame(0, 1, whole.color, whole.depth_m, camera, np.eye(4))
        pixels = rectangle(depth.shape, slice(20 * scale, 100 * scale), slice(40 * scale, 120 * scale))
        [made], _ = acquire(scaled, [mask(pixels)], PARAMETERS)
        voxels = np.floor(made.points / PARAMETERS.voxel_m).astype(int)
        assert len(np.unique(voxels, axis=0)) == made.n
        sizes.append(made.n)
    assert sizes[1] == pytest.approx(sizes[0], rel=0.07)


def test_the_largest_cluster_leaves_background_that_the_mask_bled_onto():
    depth = np.full((120, 160), 1.0)
    depth[:, 100:] = 2.0  # a wall behind the thing
    depth[10:12, 10:12] = 0.4  # flying pixels
    [made], _ = acquire(frame(depth), [mask(rectangle(depth.shape, slice(5, 100), slice(5, 110)))], PARAMETERS)
    depth_of_points = apply(np.linalg.inv(T), made.points.astype(float))[:, 2]
    assert depth_of_points.max() < 1.1 and depth_of_points.min() > 0.9


def test_what_is_out_of_the_depth_range_is_no_evidence():
    depth = np.full((120, 160), 1.0)
    depth[:60] = 7.5
    depth[60:65] = 0.05
    [made], _ = acquire(frame(depth), [mask(np.ones(depth.shape, bool))], PARAMETERS)
    assert np.ptp(apply(np.linalg.inv(T), made.points.astype(float))[:, 2]) < 0.05


def test_what_lies_out_of_range_is_refused_with_its_distance_and_the_limit():
    pixels = rectangle((120, 160), slice(0, 50), slice(0, 50))
    for depth_m, said in (
        (7.2, "it is 7 m away, and depth_max_m is 6 m"),
        (0.05, "0.05 m away, and depth_min_m is 0.1"),
    ):
        _, [refused] = acquire(frame(np.full((120, 160), depth_m)), [mask(pixels)], PARAMETERS)
        assert refused.reason.startswith("fewer than 50 pixels with depth in range: ") and said in refused.reason


SCATTER_M = np.random.default_rng(5).uniform(1.0, 6.0, (120, 160))


@pytest.mark.parametrize(
    ("depth_m", "pixels", "reason"),
    [
        (1.0, rectangle((120, 160), slice(0, 9), slice(0, 11)), "mask smaller than 100 pixels"),
        (0.0, rectangle((120, 160), slice(0, 50), slice(0, 50)), "fewer than 50 pixels with depth in range"),
        (SCATTER_M, rectangle((120, 160), slice(0, 12), slice(0, 12)), "its points are too sparse to cluster"),
        (1.0, rectangle((60, 80), slice(0, 50), slice(0, 50)), "mask has another size than the frame"),
    ],
)
def test_a_mask_that_gives_no_observation_is_refused_by_reason(depth_m, pixels, reason):
    depth = np.full((120, 160), depth_m)
    depth[0:80, 80:] = 1.0
    good = mask(rectangle((120, 160), slice(0, 80), slice(80, 160)), index=1)
    made, [refused] = acquire(frame(depth), [mask(pixels), good], PARAMETERS)
    assert (refused.frame, refused.mask, refused.reason) == (7, 0, reason)
    assert [o.mask for o in made] == [1]


def test_a_mask_without_a_pixel_is_refused_whatever_the_parameters_allow():
    empty, all_allowed = np.zeros((120, 160), bool), Parameters(min_mask_px=0, min_points=0)
    _, [refused] = acquire(frame(np.full((120, 160), 1.0)), [mask(empty)], all_allowed)
    assert refused.reason == "mask has no pixel"


def test_an_observation_remembers_where_it_came_from():
    color = np.zeros((300, 400, 3), np.uint8)
    color[40:260, 40:360] = (200, 10, 10)
    pixels = rectangle((300, 400), slice(50, 250), slice(50, 350))
    [made], _ = acquire(frame(np.full((300, 400), 1.0), color=color), [mask(pixels, phrase="")], PARAMETERS)
    source = made.provenance
    assert (made.key, source.stamp_ns, source.bbox) == (("walk", 7, 0), 123, (50, 50, 350, 250))
    assert made.phrase is None  # an empty phrase is an observation without language
    np.testing.assert_array_equal(decode_rle(source.rle), pixels)
    crop = cv2.cvtColor(cv2.imdecode(np.frombuffer(source.crop_jpeg, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
    assert max(crop.shape) == CROP_MAX_PX
    np.testing.assert_allclose(crop[90, 120], (200, 10, 10), atol=6)


def test_parameters_that_no_mask_can_be_clustered_with_are_named_as_the_reason():
    whole = rectangle((120, 160), slice(0, 80), slice(0, 80))
    fine = Parameters(voxel_m=0.001, cluster_eps_m=0.08)
    made, [refused] = acquire(frame(np.full((120, 160), 1.0)), [mask(whole)], fine)
    assert not made and refused.reason == "cluster_eps_m is more than 40 times voxel_m"
