"""With a D435i on USB 3: `pytest -m hardware tests/drivers/realsense`."""

from __future__ import annotations

import time

import numpy as np
import pytest

from drivers.clock import SystemClock
from drivers.realsense.camera import RealSenseCamera
from drivers.realsense.messages import RealSenseSettings, TimestampDomain

pytestmark = pytest.mark.hardware


@pytest.fixture(autouse=True)
def _asked_for(request: pytest.FixtureRequest) -> None:
    if "hardware" not in request.config.option.markexpr:
        pytest.skip("needs a D435i on USB 3; run with -m hardware")


def test_a_real_camera_streams_for_ten_seconds() -> None:
    with RealSenseCamera(RealSenseSettings(), SystemClock()) as camera:
        print(camera.info)
        frames, samples, end = [], [], time.monotonic() + 10
        while time.monotonic() < end:
            time.sleep(0.2)
            frames += camera.take_frames()
            samples += camera.take_imu()
        print(camera.health())
    stamps = np.array([frame.stamp_ns for frame in frames])
    assert len(frames) > 250 and (np.diff(stamps) > 0).all()
    assert frames[-1].domain is TimestampDomain.GLOBAL
    assert 1800 < len(samples) < 2200
    assert np.linalg.norm(samples[-1].acceleration_m_s2) == pytest.approx(9.81, abs=0.5)
    assert (frames[-1].depth_m > 0).mean() > 0.3
