from __future__ import annotations

import numpy as np
import pytest

from openbelief.backprojection import backproject
from openbelief.g1 import COLOR_INTRINSICS, T_BASE_CAMERA, T_BASE_LIDAR
from openbelief.observation import RgbdFrame
from openbelief.parameters import Parameters
from openbelief.pose import Pose2, apply
from sim_fakes.sensors.depth_noise import noisy_depth
from sim_fakes.sensors.lidar_scan import scan
from sim_fakes.world.renderer import Renderer

HERE = Pose2(1.0, 1.4, 0.15)


@pytest.fixture
def renderer(small_world):
    return Renderer(small_world)


@pytest.fixture
def view(renderer):
    return renderer.render(HERE.matrix() @ T_BASE_CAMERA, COLOR_INTRINSICS)


def test_pixels_of_an_object_lie_in_its_box(small_world, view):
    T = HERE.matrix() @ T_BASE_CAMERA
    frame = RgbdFrame(0, 0, view.color, view.depth_m, COLOR_INTRINSICS, T)
    for thing in small_world.objects[:2]:
        mask = view.instances == thing.id
        assert mask.sum() > 3000
        points = backproject(mask, frame, Parameters())
        assert (points >= thing.aabb[0] - 1e-3).all()
        assert (points <= thing.aabb[1] + 1e-3).all()


def test_the_floor_is_at_height_zero_and_is_called_so(view):
    frame = RgbdFrame(0, 0, view.color, view.depth_m, COLOR_INTRINSICS, HERE.matrix() @ T_BASE_CAMERA)
    points = backproject(view.instances == 1, frame, Parameters())
    assert np.abs(points[:, 2]).max() < 1e-3


def test_segment_says_what_render_says(renderer, view):
    depth_m, instances = renderer.segment(HERE.matrix() @ T_BASE_CAMERA, COLOR_INTRINSICS)
    assert np.array_equal(depth_m, view.depth_m)
    assert np.array_equal(instances, view.instances)


def test_a_red_thing_looks_red(view):
    red, green, blue = view.color[view.instances == 100].mean(axis=0)
    assert red > 2 * green
    assert red > 2 * blue


def test_the_top_view_has_the_whole_flat_in_its_extent(renderer, small_world):
    image, low, high = renderer.top_view(20)
    assert image.shape == (60, 120, 3)
    assert low.tolist() == [0, 0]
    assert high.tolist() == [6, 3]
    row, column = int((3 - 1.2) * 20), int(2.4 * 20)
    assert image[row, column, 0] > 1.5 * image[row, column, 1]  # the red vase, seen from above


def test_depth_noise_grows_with_distance_and_stays_small(view):
    noisy = noisy_depth(view.depth_m, view.color, seed=1, stamp_ns=5)
    measured = noisy > 0
    error = np.abs(noisy - view.depth_m)
    assert measured.mean() > 0.8
    near, far = measured & (view.depth_m < 1.5), measured & (view.depth_m > 1.9)
    assert error[near].mean() < error[far].mean() < 0.02
    assert not measured[view.depth_m == 0].any()


def test_depth_noise_follows_from_seed_and_stamp_alone(view):
    once = noisy_depth(view.depth_m, view.color, seed=1, stamp_ns=5)
    assert np.array_equal(once, noisy_depth(view.depth_m, view.color, seed=1, stamp_ns=5))
    assert not np.array_equal(once, noisy_depth(view.depth_m, view.color, seed=2, stamp_ns=5))
    assert not np.array_equal(once, noisy_depth(view.depth_m, view.color, seed=1, stamp_ns=6))


def test_background_left_of_a_foreground_edge_is_in_stereo_shadow():
    depth, color = np.full((100, 200), 2.0, np.float32), np.full((100, 200, 3), 128, np.uint8)
    depth[:, 100:140] = 1.0  # disparity 32 px against 16 px
    lost = noisy_depth(depth, color, seed=0, stamp_ns=0) == 0
    assert lost[:, 86:98].mean() > 0.95
    assert lost[:, 145:190].mean() < 0.05


def test_lidar_points_lie_on_what_is_there(renderer, small_world):
    T = HERE.matrix() @ T_BASE_LIDAR
    cloud = scan(renderer, T, seed=0, stamp_ns=100)
    points = apply(T, cloud.points)
    assert 1500 < len(points) <= 3000
    assert points[:, 2].min() > -0.1  # never under the floor: the sensor hangs upside down and looks down
    assert (np.abs(points[:, 2]) < 0.06).mean() > 0.1  # a floor where the floor is
    assert points[:, 0].min() > -0.1
    assert points[:, 2].max() < 2.6
    again = scan(renderer, T, seed=0, stamp_ns=100)
    assert np.array_equal(cloud.points, again.points)
    assert not np.array_equal(cloud.points[:100], scan(renderer, T, seed=0, stamp_ns=200_000_000).points[:100])
