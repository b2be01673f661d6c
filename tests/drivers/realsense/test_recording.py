"""A recording that librealsense made of the twin, played back through the same driver."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import SystemClock
from drivers.ports import LinkLost, PortError
from drivers.realsense.camera import RealSenseCamera
from drivers.realsense.messages import RealSenseSettings
from drivers.realsense.process import recorded
from sim_fakes.sensors.realsense_software import rs

MOMENTS = 12


@pytest.fixture
def recording(make_bench, tmp_path) -> tuple[Path, list[int]]:
    """The file, and the stamps of what was fed while it recorded."""
    path = tmp_path / "walk.db3"
    bench = make_bench(device=lambda twin: rs.recorder(str(path), twin.device))
    for _ in range(MOMENTS):
        bench.moment()
    bench.stream.close()
    bench.stream._device = None  # the recorder finishes its file when nobody holds it
    return path, bench.stamps


def play(path: Path) -> RealSenseCamera:
    return RealSenseCamera(RealSenseSettings(), SystemClock(), open_device=partial(recorded, path))


def test_what_was_recorded_comes_back_with_its_stamps(recording, eventually) -> None:
    path, stamps = recording
    frames, samples = [], []

    def over() -> bool:
        try:
            frames.extend(camera.take_frames())
            samples.extend(camera.take_imu())
        except LinkLost as error:
            return "The recording is over" in str(error)
        return False

    with play(path) as camera:
        assert camera.info.usb == "3.2" and camera.info.intrinsics.fx == 615.0
        eventually(over)
    played = [frame.device_stamp_ns for frame in frames]
    assert len(played) >= MOMENTS - 3  # the syncer lets the first pass unpaired, and drops what is not read in time
    assert all(min(abs(stamp - fed) for fed in stamps) < 1000 for stamp in played)
    assert np.median(frames[-1].depth_m[frames[-1].depth_m > 0]) == pytest.approx(2.0, abs=0.005)
    assert samples and samples[0].gyro_rad_s[1] == pytest.approx(0.1)


def test_a_recording_is_never_fresh(recording, eventually) -> None:
    with play(recording[0]) as camera:
        eventually(lambda: camera.health().counts.frames > 0)
        with pytest.raises(PortError):
            camera.latest(1.0)


def test_a_file_that_is_no_recording_is_refused(tmp_path) -> None:
    path = tmp_path / "no.db3"
    with pytest.raises(PortError, match="There is no RealSense recording"):
        play(path).start()
    path.write_bytes(b"no recording at all")
    with pytest.raises(PortError, match="cannot be played"):
        play(path).start()
