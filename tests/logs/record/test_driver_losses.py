"""What a driver lost stands in the recording's counts, by where: the MID-360's real driver, and cameras that tell."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import SimClock, SystemClock
from drivers.livox.driver import LivoxLidar
from drivers.livox.intake import KEPT_CLOUDS
from drivers.livox.settings import LivoxPorts, LivoxSettings
from drivers.ports import LinkLost
from drivers.realsense.camera import RealSenseCamera
from drivers.realsense.messages import CameraImuSample, RealSenseFrame, RealSenseSettings, StreamCounts, TimestampDomain
from drivers.realsense.restarts import RestartLimits
from drivers.topics import CAMERA_IMU, DEPTH, LIDAR, LIDAR_IMU
from logs.record.driver_losses import NOT_TAKEN, Growth
from logs.record.port_tap import PortTap
from logs.record.queued import QueuedRecorder
from logs.record.recorder import McapRecorder
from openbelief.observation import Intrinsics
from sim_fakes.sensors.livox_emulator import EmulatorSettings, LivoxEmulator
from sim_fakes.sensors.livox_faults import LivoxFaults
from sim_fakes.sensors.realsense_bus import open_twin
from sim_fakes.sensors.realsense_faults import Fault, TwinState
from sim_fakes.sensors.realsense_software import TwinSpec, box_images
from support.waiting import until

CAMERA = Intrinsics(fx=60.0, fy=60.0, cx=32.0, cy=24.0, width=64, height=48)
FREE_PORTS = ("points", "imu", "push", "command")
NETWORK = "packets lost on the network"


@pytest.fixture
def clock() -> SimClock:
    return SimClock(1_700_000_000_000_000_000)


@pytest.fixture
def queue(clock: SimClock, tmp_path: Path) -> Iterator[QueuedRecorder]:
    with McapRecorder(tmp_path / "a.mcap", clock) as recorder, QueuedRecorder(recorder, clock) as queue:
        yield queue


@dataclass
class Mid360:
    """An emulated lidar that sends to the real driver."""

    lidar: LivoxLidar
    emulator: LivoxEmulator
    clock: SimClock

    def run(self, seconds: float) -> None:
        """In small steps, each received before the next."""
        for _ in range(round(seconds / 0.02)):
            self.clock.sleep(0.02)
            self.emulator.advance_to(self.clock.now_ns())
            until(self._received)

    def _received(self) -> bool:
        health, sent = self.lidar.health(), self.emulator.stream.sent
        return health.packets + health.imu_packets == sent["points"] + sent["imu"] - self.emulator.faults.counts["drop"]


@pytest.fixture
def mid360(clock: SimClock) -> Iterator[Mid360]:
    lidar_ports = dict.fromkeys(("search_port", "command_port", "push_port", "points_port", "imu_port"), 0)
    emulator = LivoxEmulator(EmulatorSettings(**lidar_ports), clock=clock, faults=LivoxFaults(seed=1))
    settings = LivoxSettings(lidar_ip="127.0.0.2", host_ip="127.0.0.1")
    with LivoxLidar(settings, clock, LivoxPorts(**dict.fromkeys(FREE_PORTS, 0))) as lidar:
        emulator.open()
        emulator.answers.destinations |= {name: ("127.0.0.1", port) for name, port in lidar.ports.items()}
        yield Mid360(lidar, emulator, clock)
        emulator.close()


def test_packets_lost_on_the_network_are_counted_from_the_recordings_beginning(
    mid360: Mid360, queue: QueuedRecorder
) -> None:
    mid360.emulator.faults.drop = 0.1
    mid360.run(0.2)
    before = mid360.lidar.health()
    tap = PortTap(queue)
    tap.add_lidar(mid360.lidar)
    tap.poll()
    assert before.lost > 0 and queue.streams[LIDAR.name].lost == {}
    mid360.run(0.4)
    mid360.emulator.faults.drop = 0.0
    mid360.run(0.1)
    tap.poll()
    after = mid360.lidar.health()
    assert queue.streams[LIDAR.name].lost == {NETWORK: after.lost - before.lost}
    assert queue.streams[LIDAR_IMU.name].lost == {NETWORK: after.imu_lost - before.imu_lost}


def test_clouds_that_were_not_taken_in_time_are_counted(mid360: Mid360, queue: QueuedRecorder) -> None:
    tap = PortTap(queue)
    tap.add_lidar(mid360.lidar)
    mid360.run(0.5)
    tap.poll()
    taken = mid360.lidar.health().clouds
    mid360.run(0.1 * KEPT_CLOUDS + 0.5)
    tap.poll()
    kept = mid360.lidar.health().clouds - taken
    assert queue.streams[LIDAR.name].lost == {NOT_TAKEN: kept - KEPT_CLOUDS}
    assert queue.streams[LIDAR.name].taken == taken + KEPT_CLOUDS
    assert queue.streams[LIDAR_IMU.name].lost == {}


@dataclass(frozen=True)
class Health:
    counts: StreamCounts


class D435:
    """A camera whose driver numbers its images and counts, as drivers.realsense.camera does."""

    def __init__(self) -> None:
        self.counts, self.waiting, self.failed = StreamCounts(), list[int](), False

    def latest(self, max_age_s: float) -> RealSenseFrame:
        return self.frame(1)

    def take_frames(self) -> list[RealSenseFrame]:
        if self.failed and not self.waiting:
            raise LinkLost("The camera has failed: 5 resets did not help.")
        taken, self.waiting = self.waiting, []
        return [self.frame(number) for number in taken]

    def take_imu(self) -> list[CameraImuSample]:
        return []

    def health(self) -> Health:
        return Health(self.counts)

    @staticmethod
    def frame(number: int) -> RealSenseFrame:
        color, depth_m = np.zeros((48, 64, 3), np.uint8), np.ones((48, 64), np.float32)
        stamp_ns, domain = 10**18 + number * 33_000_000, TimestampDomain.GLOBAL
        numbers = (domain, stamp_ns, stamp_ns, number, number)
        return RealSenseFrame(stamp_ns, color, depth_m, CAMERA, "camera", *numbers)


def test_a_cameras_losses_are_told_by_where_and_each_once(queue: QueuedRecorder) -> None:
    camera, tap = D435(), PortTap(queue)
    camera.counts = StreamCounts(lost=7)  # before this recording
    tap.add_camera(camera)
    stream = queue.stream(DEPTH.name)
    for counts, numbers, lost in (
        (StreamCounts(lost=7), [3, 10], {}),
        (StreamCounts(lost=9, no_slot=1), [11, 15], {"never came": 2, "found the": 1}),
        (StreamCounts(lost=9, no_slot=1), [20, 21], {"never came": 2, "found the": 1, NOT_TAKEN: 4}),
        (StreamCounts(lost=1), [1, 3], {"never came": 3, "found the": 1, NOT_TAKEN: 4}),  # a new camera process
    ):
        camera.counts, camera.waiting = counts, list(numbers)
        tap.poll()
        told = {next(key for key in lost if where.startswith(key)): count for where, count in stream.lost.items()}
        assert told == lost
    assert stream.taken == 8 and CAMERA_IMU.name in queue.streams


def test_a_camera_that_has_failed_for_good_is_gone_and_its_last_images_are_kept(queue: QueuedRecorder) -> None:
    camera, tap = D435(), PortTap(queue)
    tap.add_camera(camera)
    camera.waiting, camera.failed = [1, 2], True
    tap.poll()
    assert queue.streams[DEPTH.name].taken == 2 and tap.gone == {}
    camera.counts = StreamCounts(lost=1)
    tap.poll()
    assert tap.gone == tap.trouble == {DEPTH.name: "The camera has failed: 5 resets did not help."}
    assert sum(queue.streams[DEPTH.name].lost.values()) == 1


@contextmanager
def tapped(state: TwinState, queue: QueuedRecorder, limits: RestartLimits | None = None) -> Iterator[PortTap]:
    """The real driver, librealsense in its own process, and inside the simulated D435i."""
    opener = partial(open_twin, box_images, TwinSpec(), state)
    with RealSenseCamera(RealSenseSettings(), SystemClock(), open_device=opener, limits=limits) as camera:
        tap = PortTap(queue)
        tap.add_camera(camera)
        yield tap


def test_images_that_the_real_camera_driver_loses_are_counted(queue: QueuedRecorder) -> None:
    state = TwinState()
    with tapped(state, queue) as tap:
        stream = queue.streams[DEPTH.name]
        until(lambda: (tap.poll(), stream.taken > 3)[1])
        state.fault = Fault.DROPPED
        until(lambda: (tap.poll(), any(where.startswith("never came whole") for where in stream.lost))[1])


def test_a_camera_that_was_unplugged_and_is_given_up_is_gone(queue: QueuedRecorder) -> None:
    state = TwinState()
    with tapped(state, queue, RestartLimits(back_off_s=())) as tap:
        state.fault = Fault.UNPLUGGED
        until(lambda: (tap.poll(), DEPTH.name in tap.gone)[1])
    assert tap.gone[DEPTH.name] == tap.trouble[DEPTH.name]


def test_images_whose_stamps_ran_backwards_are_kept_and_counted(queue: QueuedRecorder) -> None:
    camera, tap = D435(), PortTap(queue)
    tap.add_camera(camera)
    camera.waiting = [5, 6, 2, 3]
    tap.poll()
    queue.drain()
    stream = queue.streams[DEPTH.name]
    assert (stream.written, stream.pace.backwards) == (4, 1)


def test_a_counter_that_is_corrected_is_no_new_beginning() -> None:
    counts = {"packets": 3}
    growth = Growth(lambda: counts)
    counts = {"packets": 5}
    growth.look()
    counts = {"packets": 4}  # one of them was only late
    assert growth.look() == {"packets": 1}
