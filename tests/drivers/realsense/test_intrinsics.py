"""librealsense's lens models in OpenCV's terms, checked with librealsense's own projection."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.realsense.messages import CameraRefused
from openbelief.observation import Intrinsics
from sim_fakes.sensors.realsense_software import TwinSpec, rs

LENS = (-0.056, 0.066, -0.0008, 0.0006, -0.021)


def spec(model: str, distortion: tuple[float, ...] = LENS) -> TwinSpec:
    return TwinSpec(color=Intrinsics(848, 480, 615.0, 614.0, 422.0, 241.0, distortion), color_model=model)


@pytest.mark.parametrize("model", ["brown_conrady", "inverse_brown_conrady"])
def test_brown_conrady_is_opencvs_model(make_bench, model) -> None:
    info = make_bench(spec(model)).info
    assert info.intrinsics.distortion == pytest.approx(LENS)
    assert info.intrinsics.fy == 614.0
    points = np.random.default_rng(3).uniform([-0.6, -0.3, 0.9], [0.6, 0.3, 1.1], (50, 3))
    lens = rs.intrinsics()
    lens.width, lens.height, lens.fx, lens.fy, lens.ppx, lens.ppy = 848, 480, 615.0, 614.0, 422.0, 241.0
    lens.model, lens.coeffs = getattr(rs.distortion, model), list(LENS)
    theirs = np.array([rs.rs2_project_point_to_pixel(lens, list(point)) for point in points])
    assert np.abs(info.intrinsics.project(points) - theirs).max() < 0.1


def test_zero_coefficients_are_a_pinhole(make_bench) -> None:
    assert make_bench(spec("inverse_brown_conrady", ())).info.intrinsics.distortion == ()


def test_each_profile_has_its_own_intrinsics(make_bench) -> None:
    info = make_bench(spec("brown_conrady")).info
    assert (info.intrinsics.fx, info.depth_intrinsics.fx) == (615.0, 425.0)


@pytest.mark.parametrize("model", ["modified_brown_conrady", "ftheta", "kannala_brandt4"])
def test_a_lens_that_opencv_cannot_express_is_refused(make_bench, model) -> None:
    with pytest.raises(CameraRefused, match=f"{model}.*recalibrate"):
        make_bench(spec(model))
