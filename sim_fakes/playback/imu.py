"""The IMU of a recorded camera or lidar, played by a clock."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from drivers.ros.messages import Message, WireError, decode, stamp_to_ns
from drivers.topics import CAMERA_IMU, IMU_TYPE, LIDAR_IMU
from logs.mcap_io.reader import LogMessage
from openbelief.arrays import Array
from sim_fakes.playback.timeline import NewestValue, TimeLine

# Whose IMU a topic is: the name that we use, else words of other people's names. A half (gyro/sample) is no IMU.
CAMERA_IMU_NAMES = (CAMERA_IMU.name, ("camera", "realsense", "d435"))
LIDAR_IMU_NAMES = (LIDAR_IMU.name, ("lidar", "livox", "mid360"))
HALVES = ("gyro", "accel")


@dataclass(frozen=True)
class RecordedImu:
    """gyro_rad_s, acceleration_m_s2: (3,) float64 in `frame_id`."""

    stamp_ns: int
    gyro_rad_s: Array
    acceleration_m_s2: Array
    frame_id: str


class RecordingImu:
    """The IMU samples of one topic; unreadable ones are left out."""

    def __init__(self, messages: Iterator[LogMessage], line: TimeLine) -> None:
        self._line, self._newest = line, NewestValue(_imu_samples(messages))

    def take_imu(self) -> list[RecordedImu]:
        taken = self._newest.take("IMU", self._line.now_ns())
        return [replace(sample, stamp_ns=stamp_ns + self._line.offset_ns) for stamp_ns, sample in taken]


def _imu_samples(messages: Iterator[LogMessage]) -> Iterator[tuple[int, RecordedImu]]:
    for message in messages:
        try:
            imu = decode(message.payload, IMU_TYPE)
        except WireError:
            continue
        stamp_ns = stamp_to_ns(imu.header.stamp)
        gyro, acceleration = _vector(imu.angular_velocity), _vector(imu.linear_acceleration)
        yield stamp_ns, RecordedImu(stamp_ns, gyro, acceleration, imu.header.frame_id)


def _vector(message: Message) -> Array:
    return np.array([message.x, message.y, message.z])


def imu_topic(topics: list[str], ours: str, words: tuple[str, ...]) -> str | None:
    """A sensor's IMU among the topics of that type; None where there is none, or several could be meant."""
    if ours in topics:
        return ours
    likely = [t for t in topics if any(w in t for w in words) and not any(half in t for half in HALVES)]
    return likely[0] if len(likely) == 1 else None
