"""A D435i as a Camera port: aligned, filtered RGB-D and IMU from a process of its own that is killed when it hangs."""

from __future__ import annotations

import multiprocessing
import threading
from collections import deque
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any

import numpy as np

from drivers.ports import Clock, LinkLost, PortError, StaleData
from drivers.realsense.depth import ColorDepth
from drivers.realsense.imu import ImuPairing
from drivers.realsense.messages import (
    CameraImuSample,
    CameraOpened,
    FrameReady,
    ProcessHeartbeat,
    RealSenseFrame,
    RealSenseInfo,
    RealSenseSettings,
    SlotFree,
    StandStill,
    StreamCounts,
    TimestampDomain,
)
from drivers.realsense.process import OpenDevice, Slots, attached, camera_process
from drivers.realsense.restarts import ProcessPhase, RestartLimits, RestartPolicy
from drivers.realsense.supervisor import ProcessSupervisor
from drivers.realsense.time import DeviceTime, WallTime
from drivers.stamps import OWN_CLOCK, require_fresh
from openbelief.lifetime import Lifetime

KEPT_FRAMES = 30  # one second
KEPT_IMU = 2500  # ten seconds at 250 Hz


@dataclass(frozen=True)
class RealSenseHealth:
    """`counts` are of the process that runs now or ran last; `restarts` and `killed` since start.

    `info` is None before the first opening, `domain` before the first image. `trouble`: why it last stopped, or None.
    """

    phase: ProcessPhase
    counts: StreamCounts
    restarts: int
    killed: int
    info: RealSenseInfo | None
    domain: TimestampDomain | None
    trouble: str | None


class RealSenseCamera(Lifetime):
    """Construct, then `start()` (or `with`): `latest` is the Camera port, `take_frames`, `take_imu` serve a recorder.

    None of them waits for the camera. `start` does, for the first answer: it raises PortError where there is no camera,
    or one that cannot serve (USB 2). Later trouble is mended by restarts: StaleData meanwhile, LinkLost after the last.
    """

    def __init__(
        self,
        settings: RealSenseSettings,
        clock: Clock,
        *,
        open_device: OpenDevice | None = None,
        limits: RestartLimits | None = None,
    ) -> None:
        self._settings, self._clock = settings, clock
        self._open_device = open_device or partial(attached, settings.serial)
        self._processes = multiprocessing.get_context("spawn")
        self._buffer = self._processes.RawArray("B", Slots.size(settings.color_size))
        self._slots = Slots(self._buffer, settings.color_size)
        self._watchdog = RestartPolicy(limits or RestartLimits())
        self._keeper = ProcessSupervisor(clock, self._watchdog, self._spawn, self._hear)
        self._lock = threading.Lock()
        self._started = self._still = False
        self._info: RealSenseInfo | None = None
        self._depth: ColorDepth | None = None
        self._counts = StreamCounts()
        self._newest: RealSenseFrame | None = None
        self._frames: deque[RealSenseFrame] = deque(maxlen=KEPT_FRAMES)
        self._imu: deque[CameraImuSample] = deque(maxlen=KEPT_IMU)
        self._wall_time, self._device_time = WallTime(clock), DeviceTime()
        self._pairing = ImuPairing()

    def start(self) -> None:
        if self._started:
            raise PortError("This camera driver was started before; construct a new one.")
        self._started = True
        self._keeper.start()
        self._keeper.answered.wait()
        try:
            self._keeper.raise_failure()
        except LinkLost as error:
            self.close()
            raise PortError(str(error)) from error

    def close(self) -> None:
        self._keeper.close()

    @property
    def info(self) -> RealSenseInfo:
        """The opened device. Raises PortError before the first opening."""
        if self._info is None:
            raise PortError("The camera was not opened yet.")
        return self._info

    def latest(self, max_age_s: float) -> RealSenseFrame:
        """The newest frame; its age counts from its colour image. Raises StaleData, LinkLost once it has failed."""
        self._keeper.raise_failure()
        frame = self._newest
        if frame is None:
            raise StaleData(f"No camera image yet.{self._trouble()}")
        trouble, now_ns = self._trouble(), self._clock.now_ns()  # librealsense takes seconds to follow a clock's step
        require_fresh("The camera", frame.stamp_ns, now_ns, max_age_s, trouble, ahead=OWN_CLOCK)
        return frame

    def take_frames(self) -> list[RealSenseFrame]:
        """The frames since the last call, one second at most; a gap in `color_number` tells what is missing."""
        return self._taken(self._frames)

    def take_imu(self) -> list[CameraImuSample]:
        """The IMU samples since the last call, ten seconds at most. Raises PortError where the camera has no IMU."""
        if not self.info.has_imu:
            raise PortError(f"{self.info.name} has no IMU{_because(self.info.imu_trouble)}")
        return self._taken(self._imu)

    def stand_still(self, still: bool) -> None:
        """Tell that the robot stands still: depth is then averaged over time. False before it moves again."""
        self._still = still
        self._keeper.order(StandStill(still))

    def health(self) -> RealSenseHealth:
        with self._lock:
            return RealSenseHealth(
                phase=self._watchdog.phase,
                counts=self._counts,
                restarts=self._watchdog.restarts,
                killed=self._keeper.killed,
                info=self._info,
                domain=None if self._newest is None else self._newest.domain,
                trouble=self._watchdog.reason if self._watchdog.failures else None,
            )

    def _taken(self, kept: deque[Any]) -> list[Any]:
        """What had come before a failure is still given out."""
        with self._lock:
            taken = list(kept)
            kept.clear()
        if not taken:
            self._keeper.raise_failure()
        return taken

    def _trouble(self) -> str:
        if not self._watchdog.failures or self._watchdog.phase is ProcessPhase.STREAMING:
            return ""
        return f" It is being restarted (failure {self._watchdog.failures}): {self._watchdog.reason}."

    # In the supervisor's thread

    def _spawn(self, reset: bool) -> tuple[SpawnProcess, Connection]:
        """A restarted camera is a new one: its clock and its IMU's begin anew."""
        self._device_time, self._pairing = DeviceTime(), ImuPairing()
        ours, theirs = self._processes.Pipe()
        process = self._processes.Process(
            target=camera_process,
            args=(theirs, self._buffer, self._settings, self._open_device, reset),
            name="realsense",
            daemon=True,
        )
        process.start()
        theirs.close()  # so that the pipe breaks when the process dies
        return process, ours

    def _hear(self, message: Any) -> None:
        if isinstance(message, CameraOpened):
            self._info, self._depth = message.info, ColorDepth(message.info)
            self._keeper.order(StandStill(self._still))
        elif isinstance(message, ProcessHeartbeat):
            samples = self._imu_samples(message)
            with self._lock:
                self._counts = message.counts
                self._imu.extend(samples)
        elif isinstance(message, FrameReady) and self._depth is not None:
            frame = self._copied(message, self._depth)
            self._keeper.order(SlotFree(message.slot))
            with self._lock:
                self._newest = frame
                self._frames.append(frame)

    def _copied(self, message: FrameReady, depth: ColorDepth) -> RealSenseFrame:
        return RealSenseFrame(
            stamp_ns=self._time(message.domain, message.device_stamp_ns),
            color=self._slots.color[message.slot].copy(),
            depth_m=depth.metres(self._slots.depth[message.slot]),
            intrinsics=self.info.intrinsics,
            frame_id=self._settings.frame_id,
            domain=message.domain,
            device_stamp_ns=message.device_stamp_ns,
            depth_device_stamp_ns=message.depth_device_stamp_ns,
            color_number=message.color_number,
            depth_number=message.depth_number,
        )

    def _imu_samples(self, message: ProcessHeartbeat) -> list[CameraImuSample]:
        completed = [done for motion in message.motions for done in self._pairing.add(motion)]
        return [
            CameraImuSample(
                self._time(gyro.domain, gyro.device_stamp_ns),
                np.array(gyro.value),
                acceleration,
                gyro.device_stamp_ns,
                gyro.domain,
            )
            for gyro, acceleration in completed
        ]

    def _time(self, domain: TimestampDomain, device_ns: int) -> int:
        """A stamp in our clock."""
        if domain is not TimestampDomain.HARDWARE:
            return self._wall_time.to_ours(device_ns)
        self._device_time.observe(device_ns, self._clock.now_ns())
        return self._device_time.to_ours(device_ns)


def _because(trouble: str | None) -> str:
    if trouble is None:
        return " (a D435 has none, a D435i has, [realsense] imu = false leaves it alone)."
    return f" that can be opened: {trouble}."
