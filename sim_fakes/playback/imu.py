"""The IMU of a recorded camera or lidar, played by a clock."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, islice

import numpy as np

from drivers.ros.messages import Message, WireError, decode, stamp_to_ns
from drivers.topics import IMU_TYPE
from logs.mcap_io.reader import LogMessage
from openbelief.arrays import Array
from sim_fakes.playback.timeline import NewestValue, TimeLine

IMU_WORDS = {
    "camera": ("camera", "realsense", "d435"),
    "lidar": ("lidar", "livox", "mid360"),
}  # of other people's names
STANDARD_GRAVITY = 9.80665  # m/s^2 in one g, in which livox_ros_driver2 sends accelerations
IN_G = 3.0  # a mean acceleration below this is in g: what stands or walks feels 9.8 m/s^2, or 1 g
JUDGED = 100  # samples, half a second


@dataclass(frozen=True)
class RecordedImu:
    """gyro_rad_s, acceleration_m_s2: (3,) float64 in `frame_id`."""

    stamp_ns: int
    gyro_rad_s: Array
    acceleration_m_s2: Array
    frame_id: str


class RecordingImu:
    """The IMU samples of one topic, in m/s^2 whatever its driver sends; `left_out` counts what cannot be used."""

    def __init__(self, messages: Iterator[LogMessage], line: TimeLine) -> None:
        self.left_out: Counter[str] = Counter()
        samples = in_metres(_imu_samples(messages, self.left_out))
        self._line, self._newest = line, NewestValue(samples)

    def take_imu(self) -> list[RecordedImu]:
        taken = self._newest.take("IMU", self._line.now_ns())
        return [replace(sample, stamp_ns=stamp_ns + self._line.offset_ns) for stamp_ns, sample in taken]


def _imu_samples(
    messages: Iterator[LogMessage], left_out: Counter[str] | None = None
) -> Iterator[tuple[int, RecordedImu]]:
    """(stamp_ns, sample) of each message whose rates and accelerations are numbers; nobody reads its orientation."""
    refused: Counter[str] = Counter() if left_out is None else left_out
    for message in messages:
        try:
            imu = decode(message.payload, IMU_TYPE)
        except WireError:
            refused["unreadable"] += 1
            continue
        stamp_ns = stamp_to_ns(imu.header.stamp)
        gyro, acceleration = _vector(imu.angular_velocity), _vector(imu.linear_acceleration)
        if not (np.isfinite(gyro).all() and np.isfinite(acceleration).all()):
            refused["rate or acceleration not finite"] += 1
            continue
        yield stamp_ns, RecordedImu(stamp_ns, gyro, acceleration, imu.header.frame_id)


def in_metres(samples: Iterator[tuple[int, RecordedImu]]) -> Iterator[tuple[int, RecordedImu]]:
    """The same, in m/s^2 where the first half second says that they are in g."""
    first = list(islice(samples, JUDGED))
    norms = [float(np.linalg.norm(sample.acceleration_m_s2)) for _, sample in first]
    scale = STANDARD_GRAVITY if norms and 0 < np.median(norms) < IN_G else 1.0
    for stamp_ns, sample in chain(first, samples):
        yield stamp_ns, replace(sample, acceleration_m_s2=sample.acceleration_m_s2 * scale)


def _vector(message: Message) -> Array:
    return np.array([message.x, message.y, message.z])
