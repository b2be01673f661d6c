"""nu against cases that can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.visibility import SelfOcclusion, expected_visibility, visibility

CAMERA = Intrinsics(64, 48, 50.0, 50.0, 31.5, 23.5)  # at the origin, looking along z: x from -0.64 z to 0.64 z
PARAMETERS = Parameters()


def frame(depth: np.ndarray | float, camera: Intrinsics = CAMERA) -> RgbdFrame:
    depth_m = np.broadcast_to(np.float32(depth), (48, 64)).astype(np.float32)
    return RgbdFrame(0, 0, np.zeros((48, 64, 3), np.uint8), depth_m, camera, np.eye(4))


def plane(x: tuple[float, float], z: float = 2.0, step: float = 0.02) -> np.ndarray:
    """Points facing the camera at distance z, half a metre high, in the middle of their voxels."""
    grid = np.meshgrid(np.arange(*x, step) + step / 2, np.arange(-0.24, 0.24, step) + step / 2)
    return np.stack((*grid, np.full_like(grid[0], z)), axis=-1).reshape(-1, 3).astype(np.float32)


def test_a_plane_in_plain_view_is_wholly_visible() -> None:
    shown = visibility(plane((-0.5, 0.5)), frame(2.0), PARAMETERS, pose_error_m=0.0)
    assert (shown.nu, shown.occluded, shown.out_of_view, shown.no_depth, shown.see_through) == (1, 0, 0, 0, 0)
    assert shown.expected == len(plane((-0.5, 0.5)))


def test_half_outside_the_image_is_half_visible() -> None:
    edge = 2.0 * 32 / 50
    shown = visibility(plane((edge - 0.5, edge + 0.5)), frame(2.0), PARAMETERS, pose_error_m=0.0)
    assert shown.nu == pytest.approx(0.5, abs=0.02)
    assert shown.out_of_view == pytest.approx(0.5, abs=0.02)


def test_three_points_in_view_of_two_thousand_are_next_to_nothing() -> None:
    points = np.concatenate((plane((-0.03, 0.03))[:3], plane((5.0, 7.0))[:1997]))
    shown = visibility(points, frame(2.0), PARAMETERS, pose_error_m=0.0)
    assert shown.expected == 2000
    assert shown.nu == pytest.approx(3 / 2000)


def test_behind_a_wall_is_occluded_and_within_the_pose_error_is_not() -> None:
    points = plane((-0.5, 0.5))
    assert visibility(points, frame(1.9), PARAMETERS, pose_error_m=0.0).occluded == 1
    assert visibility(points, frame(1.9), PARAMETERS, pose_error_m=0.10).nu == 1
    assert visibility(points, frame(1.0), PARAMETERS, pose_error_m=0.10).occluded == 1


def test_looking_through_the_stored_place_counts_as_visible_and_is_reported() -> None:
    shown = visibility(plane((-0.5, 0.5)), frame(3.0), PARAMETERS, pose_error_m=0.10)
    assert (shown.nu, shown.see_through) == (1, 1)


@pytest.mark.parametrize("nothing", [0.0, np.nan, np.inf])
def test_a_hole_in_the_depth_is_not_visibility(nothing: float) -> None:
    depth = np.full((48, 64), 2.0, np.float32)
    depth[:, :32] = nothing
    shown = visibility(plane((-0.5, 0.5)), frame(depth), PARAMETERS, pose_error_m=0.0)
    assert shown.nu == pytest.approx(0.5, abs=0.03)
    assert shown.no_depth == pytest.approx(0.5, abs=0.03)
    assert shown.nu + shown.occluded + shown.out_of_view + shown.no_depth == pytest.approx(1.0)


def test_points_behind_the_camera_are_out_of_view() -> None:
    shown = visibility(plane((-0.5, 0.5), z=-2.0), frame(2.0), PARAMETERS, pose_error_m=0.0)
    assert (shown.nu, shown.out_of_view) == (0, 1)


def test_distortion_does_not_fold_far_points_back_into_the_image() -> None:
    barrel = Intrinsics(64, 48, 50.0, 50.0, 31.5, 23.5, (-0.3, 0.05, 0.0, 0.0, 0.0))
    points = plane((6.0, 8.0))  # at x/z >= 3 this polynomial projects to the middle again
    assert visibility(points, frame(2.0, barrel), PARAMETERS, pose_error_m=0.0).out_of_view == 1


def test_the_far_side_of_a_box_is_not_expected() -> None:
    front, back = plane((-0.3, 0.3), z=2.0), plane((-0.3, 0.3), z=2.6)
    shown = visibility(np.concatenate((front, back)), frame(2.0), PARAMETERS, pose_error_m=0.10)
    assert shown.nu == 1
    assert shown.expected == pytest.approx(len(front), rel=0.02)  # and not half hidden, half visible


def test_a_table_top_seen_at_a_low_angle_does_not_hide_itself() -> None:
    x, z = np.meshgrid(np.arange(-0.4, 0.4, 0.02), np.arange(1.0, 2.0, 0.02))
    top = np.column_stack((x.ravel(), np.full(x.size, 0.5), z.ravel())).astype(np.float32)  # 0.5 m under the lens
    hidden = SelfOcclusion(top, 0.02).hides(top, np.zeros(3), np.full(len(top), 0.13))
    assert hidden.mean() < 0.02


def test_a_very_large_object_is_answered_from_a_coarser_screen() -> None:
    room = np.random.default_rng(0).uniform(-10, 10, (20_000, 3)).astype(np.float32)
    assert 0 <= visibility(room, frame(2.0), PARAMETERS, pose_error_m=0.1).nu <= 1


def test_what_a_pose_would_show_is_what_an_unobstructed_image_shows() -> None:
    edge = 2.0 * 32 / 50
    for x in ((-0.5, 0.5), (edge - 0.5, edge + 0.5), (3.0, 4.0)):
        points = plane(x)
        shown = visibility(points, frame(2.0), PARAMETERS, pose_error_m=0.0).nu
        screen = SelfOcclusion(points, PARAMETERS.voxel_m)
        assert expected_visibility(points, screen, np.eye(4), CAMERA, PARAMETERS) == pytest.approx(shown)


def test_beyond_the_depth_camera_nothing_is_expected_to_be_seen() -> None:
    points = plane((-0.5, 0.5), z=7.0)
    assert expected_visibility(points, SelfOcclusion(points, 0.02), np.eye(4), CAMERA, PARAMETERS) == 0
