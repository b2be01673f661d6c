"""The G1's mounts reproduce what is known of its camera."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief.g1 import COLOR_INTRINSICS, T_BASE_CAMERA, T_BASE_LIDAR
from openbelief.goal_pose import seen_heights
from openbelief.visibility import in_image


def test_the_colour_camera_sees_the_floor_from_049_to_255_m() -> None:
    x = np.arange(0.0, 4.0, 0.005)
    floor = np.column_stack(
        (x, np.zeros_like(x), np.full_like(x, -T_BASE_CAMERA[2, 3]))
    )  # before the lens, in base axes
    seen, _, _ = in_image(floor @ T_BASE_CAMERA[:3, :3], COLOR_INTRINSICS)
    assert x[seen].min() == pytest.approx(0.49, abs=0.01)
    assert x[seen].max() == pytest.approx(2.55, abs=0.02)


def test_the_colour_camera_sees_nothing_above_067_m_at_12_m() -> None:
    assert seen_heights(T_BASE_CAMERA, COLOR_INTRINSICS, 1.2)[1] == pytest.approx(0.67, abs=0.005)


def test_the_lidar_hangs_upside_down_at_eye_height() -> None:
    assert T_BASE_LIDAR[:3, 2] @ [0, 0, 1] < -0.99
    assert T_BASE_LIDAR[2, 3] == pytest.approx(1.26, abs=0.01)
