"""Depth in colour's pixels, judged against a scene whose geometry is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from drivers.realsense.depth import ColorDepth
from drivers.realsense.messages import RealSenseSettings
from openbelief.observation import Intrinsics
from openbelief.pose import quaternion_from_rpy, transform
from sim_fakes.sensors.realsense_scene import BoxScene
from sim_fakes.sensors.realsense_software import TwinSpec

LENS = (0.05, -0.08, 0.001, -0.0008, 0.02)
HD = Intrinsics(1280, 720, 920.0, 918.0, 645.0, 352.0)
CASES = {
    "a pure baseline": TwinSpec(),
    "a turned imager": TwinSpec(
        T_depth_color=transform([0.015, 0.001, -0.002], quaternion_from_rpy(0.01, -0.008, 0.005))
    ),
    "a distorting lens": TwinSpec(
        color=Intrinsics(848, 480, 610.0, 611.0, 430.0, 236.0, LENS), color_model="brown_conrady"
    ),
    "a high-resolution colour image": TwinSpec(color=HD),
}


@pytest.mark.parametrize("name", CASES)
def test_aligned_depth_is_what_the_colour_camera_would_have_measured(make_bench, name) -> None:
    spec = CASES[name]
    bench = make_bench(spec, settings=RealSenseSettings(color_size=(spec.color.width, spec.color.height)))
    pair = bench.settled()
    _, truth_m = BoxScene().seen(spec.color, np.eye(4))
    on_box = truth_m < 1.5
    error_m = np.abs(ColorDepth(bench.info).metres(pair.depth) - truth_m)
    for face in (on_box, ~on_box):
        inside = binary_erosion(face, iterations=16) & (pair.depth > 0)  # edges mix, as on the real camera
        assert inside.sum() > 0.6 * face.sum()
        assert np.percentile(error_m[inside], 99) < 0.003


def test_the_box_edge_lies_where_colour_shows_it(make_bench) -> None:
    """Without alignment it would be 15 mm, that is 8 pixels, beside it."""
    bench = make_bench()
    pair = bench.settled()
    row_color, row_depth = pair.color[240, :, 0], pair.depth[240]
    right_in_color = int(np.flatnonzero(row_color > 150).max())
    near = np.flatnonzero((row_depth > 0) & (row_depth < 1600))
    assert abs(int(near.max()) - right_in_color) <= 3


def test_holes_stay_holes(make_bench) -> None:
    """What was not measured is 0, never filled from its surroundings."""
    color = np.full((480, 848, 3), 120, np.uint8)
    depth_m = np.full((480, 848), 2.0, np.float32)
    depth_m[200:280, 400:480] = 0

    bench = make_bench(images=lambda _spec: lambda _stamp_ns: (color, depth_m))
    depth = bench.settled().depth
    assert (depth[230:250, 400:470] == 0).all()


@pytest.mark.parametrize("metres", [0.1, 7.0])
def test_what_is_out_of_range_is_not_measured(make_bench, metres) -> None:
    color = np.full((480, 848, 3), 120, np.uint8)
    depth_m = np.full((480, 848), metres, np.float32)
    bench = make_bench(images=lambda _spec: lambda _stamp_ns: (color, depth_m))
    assert not bench.settled().depth.any()
