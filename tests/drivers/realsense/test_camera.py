"""The Camera port over a camera process that streams, hangs, dies, freezes and comes back: real processes, real SDK."""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import SystemClock
from drivers.ports import ANY_AGE_S, Camera, Clock, LinkLost, PortError, StaleData
from drivers.realsense.camera import RealSenseCamera
from drivers.realsense.messages import RealSenseSettings, TimestampDomain
from drivers.realsense.restarts import RestartLimits
from sim_fakes.sensors.realsense_bus import open_twin
from sim_fakes.sensors.realsense_faults import Fault, TwinState
from sim_fakes.sensors.realsense_scene import BoxScene
from sim_fakes.sensors.realsense_software import TwinSpec, box_images

QUICK = RestartLimits(back_off_s=(0.05, 0.05, 0.05))
UNHURRIED = RestartLimits(back_off_s=(1.0, 1.0, 1.0))  # the images of before the trouble grow stale meanwhile
SPEC = TwinSpec()


@pytest.fixture
def state() -> TwinState:
    return TwinState()


@pytest.fixture
def make_camera(state) -> Iterator[Callable[..., RealSenseCamera]]:
    with ExitStack() as opened:

        def make(spec: TwinSpec = SPEC, limits: RestartLimits = QUICK, clock: Clock | None = None) -> RealSenseCamera:
            opener = partial(open_twin, box_images, spec, state)
            camera = RealSenseCamera(RealSenseSettings(), clock or SystemClock(), open_device=opener, limits=limits)
            opened.callback(camera.close)
            camera.start()
            return camera

        yield make


@pytest.fixture
def sees(eventually) -> Callable[..., None]:
    """Wait until the camera gives images newer than that."""

    def newer(camera: RealSenseCamera, after_ns: int) -> bool:
        try:
            return camera.latest(1.0).stamp_ns > after_ns
        except StaleData:
            return False

    return lambda camera, after_ns=0: eventually(lambda: newer(camera, after_ns))


def refusal(camera: RealSenseCamera) -> str:
    """Why it gives no image younger than 50 ms, empty where it does."""
    try:
        camera.latest(0.05)
    except StaleData as error:
        return str(error)
    return ""


def test_it_gives_images_imu_and_health(make_camera, sees, eventually) -> None:
    camera = make_camera()
    assert isinstance(camera, Camera)
    sees(camera)
    frame = camera.latest(1.0)
    truth, truth_m = BoxScene().seen(SPEC.color, np.eye(4))
    assert np.abs(frame.color.astype(int) - truth).max() <= 1
    assert frame.depth_m.dtype == np.float32
    assert np.median(np.abs(frame.depth_m - truth_m)[frame.depth_m > 0]) < 0.002
    assert frame.intrinsics == camera.info.intrinsics and frame.frame_id == "camera_color_optical_frame"
    assert frame.domain is TimestampDomain.GLOBAL
    assert 0 <= time.time_ns() - frame.stamp_ns < 30_000_000_000  # of now, not since the camera was opened or 1970
    eventually(lambda: camera.health().counts.frames > 3)
    samples = camera.take_imu()
    assert np.all(np.diff([sample.stamp_ns for sample in samples]) > 0)
    assert samples[0].acceleration_m_s2[1] == pytest.approx(-9.80665, abs=1e-3)
    numbers = [frame.color_number for frame in camera.take_frames()]
    assert numbers == sorted(set(numbers))
    assert camera.health().trouble is None and camera.health().restarts == 0


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (Fault.HANG, "librealsense hangs"),
        (Fault.CRASH, "died"),
        (Fault.SILENT, "no new image"),
        (Fault.PIXELS_FROZEN, "frozen"),
    ],
)
def test_trouble_is_stale_with_its_cause_then_mended_by_a_reset(
    make_camera, sees, eventually, state, fault, words
) -> None:
    camera = make_camera(limits=UNHURRIED)
    sees(camera)
    state.fault = fault
    eventually(lambda: words in refusal(camera))
    assert words in camera.health().trouble
    sees(camera, after_ns=time.time_ns())
    assert state.resets >= 1 and camera.health().restarts >= 1
    assert camera.health().killed >= (fault is Fault.HANG)


def test_an_unplugged_camera_is_given_up_with_a_name(make_camera, sees, eventually, state) -> None:
    camera = make_camera(limits=RestartLimits(back_off_s=()))
    sees(camera)
    state.fault = Fault.UNPLUGGED

    def lost() -> bool:
        try:
            camera.latest(60)
        except LinkLost as error:
            return "disconnected" in str(error)
        return False

    eventually(lost)


def test_usb_2_is_refused_by_start(make_camera, state) -> None:
    with pytest.raises(PortError, match=r"USB 2\.1"):
        make_camera(TwinSpec(usb="2.1"))
    assert state.openings == 1  # no restart can help


def test_no_camera_is_refused_by_start(make_camera, state) -> None:
    state.fault = Fault.UNPLUGGED
    with pytest.raises(PortError, match="No RealSense"):
        make_camera()


class JumpingClock(SystemClock):
    """The real clock, put back at will."""

    ahead_ns = 0

    def now_ns(self) -> int:
        return super().now_ns() + self.ahead_ns


def test_an_image_from_the_future_is_not_fresh(make_camera, sees, eventually, state) -> None:
    clock = JumpingClock()
    camera = make_camera(clock=clock)
    sees(camera)
    state.fault = Fault.SILENT
    eventually(lambda: clock.now_ns() - camera.latest(60).stamp_ns > 400_000_000)  # none is on its way any more
    clock.ahead_ns = -60_000_000_000
    with pytest.raises(StaleData, match="ahead of our clock"):
        camera.latest(1.0)
    camera.latest(ANY_AGE_S)  # who judges by what changes does not ask how old it is


MISSION = """
import multiprocessing, time
from functools import partial
from drivers.clock import SystemClock
from drivers.realsense.camera import RealSenseCamera
from drivers.realsense.messages import RealSenseSettings
from sim_fakes.sensors.realsense_bus import open_twin
from sim_fakes.sensors.realsense_faults import TwinState
from sim_fakes.sensors.realsense_software import TwinSpec, box_images
opener = partial(open_twin, box_images, TwinSpec(), TwinState())
with RealSenseCamera(RealSenseSettings(), SystemClock(), open_device=opener):
    print(multiprocessing.active_children()[0].pid, flush=True)
    time.sleep(60)
"""


def test_the_camera_process_does_not_outlive_a_killed_mission(eventually) -> None:
    with subprocess.Popen([sys.executable, "-c", MISSION], stdout=subprocess.PIPE, text=True) as mission:
        child = Path("/proc") / mission.stdout.readline().strip() / "stat"
        assert child.exists()
        mission.kill()

    def ended() -> bool:
        try:
            return child.read_text().split()[2] == "Z"  # nobody reaps orphans in a container
        except (FileNotFoundError, ProcessLookupError):
            return True

    eventually(ended)


def test_nothing_is_left_running_after_close(make_camera, sees) -> None:
    camera = make_camera()
    sees(camera)
    camera.close()
    assert not [child for child in multiprocessing.active_children() if child.name == "realsense"]
