"""A robot's own sensors as ROS topics on Zenoh, where no ROS node publishes them: the other end of topics.py.

A publisher's `step` sends what is new and due; call it more often than its rate. Without fresh data it sends nothing
(the workstation sees the age); a sensor that failed raises LinkLost. What the link cannot carry is dropped.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from drivers.ports import Camera, CameraFrame, Clock, Lidar, LidarCloud, StaleData
from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.clouds import cloud_message
from drivers.ros.convert import imu_message, transforms_message
from drivers.ros.diagnosis import Diagnosis, diagnostics_message
from drivers.ros.image_messages import (
    camera_info_message,
    color_message,
    depth_message,
    depth_png_message,
    jpeg_message,
)
from drivers.ros.messages import Message, encode
from drivers.ros.zenoh_link import ZenohLink
from drivers.topics import CAMERA_INFO, COLOR_JPEG, DEPTH_PNG, DIAGNOSTICS, LIDAR, LIDAR_IMU, TF_STATIC, Topic
from openbelief.arrays import Array

MOUNTS_EVERY_S = 1.0  # repeated, so that who comes late has them too
DIAGNOSES_EVERY_S = 1.0
MAX_AGE_S = 0.5  # an older sample of a sensor is not worth sending


class Publisher(Protocol):
    def step(self) -> None:
        """Send what is new and due. Raises PortError where the sensor or the link has failed."""
        ...


@dataclass(frozen=True)
class Outlet:
    """Where messages go. sent: how many so far, by topic."""

    link: ZenohLink
    keys: BridgeKeys = field(default_factory=BridgeKeys)
    sent: Counter[str] = field(default_factory=Counter)

    def send(self, topic: Topic, message: Message) -> None:
        self.link.put(self.keys.topic(topic), encode(message), drop=True)
        self.sent[topic.name] += 1


@dataclass(frozen=True)
class CameraTopics:
    """Under which names a camera is published; the type (raw or compressed) follows the topic's."""

    color: Topic = COLOR_JPEG
    depth: Topic = DEPTH_PNG
    camera_info: Topic = CAMERA_INFO


class Throttle:
    """Lets through one in a period by the clock, whatever comes."""

    def __init__(self, clock: Clock, period_s: float) -> None:
        self._clock, self._period_ns, self._due_ns = clock, round(period_s * 1e9), 0

    def due(self) -> bool:
        now_ns = self._clock.now_ns()
        if now_ns < self._due_ns:
            return False
        self._due_ns = max(self._due_ns + self._period_ns, now_ns)
        return True


class NewSamples:
    """The newest sample of a port where it was not given out yet and is due."""

    def __init__(self, latest: Callable[[float], Any], throttle: Throttle) -> None:
        self._latest, self._throttle, self._stamp_ns = latest, throttle, 0

    def take(self) -> Any | None:
        try:
            sample = self._latest(MAX_AGE_S)
        except StaleData:
            return None
        if sample.stamp_ns == self._stamp_ns or not self._throttle.due():
            return None
        self._stamp_ns = sample.stamp_ns
        return sample


class CameraPublisher:
    """Colour, depth and calibration of each frame, under one stamp."""

    def __init__(
        self, outlet: Outlet, clock: Clock, camera: Camera, *, rate_hz: float = 15.0, topics: CameraTopics | None = None
    ) -> None:
        self._outlet, self._topics = outlet, topics or CameraTopics()
        self._frames = NewSamples(camera.latest, Throttle(clock, 1.0 / rate_hz))

    def step(self) -> None:
        frame: CameraFrame | None = self._frames.take()
        if frame is None:
            return
        topics, stamp_ns, frame_id = self._topics, frame.stamp_ns, frame.frame_id
        color = jpeg_message if topics.color.type_name == COLOR_JPEG.type_name else color_message
        depth = depth_png_message if topics.depth.type_name == DEPTH_PNG.type_name else depth_message
        self._outlet.send(topics.color, color(stamp_ns, frame_id, frame.color))
        self._outlet.send(topics.depth, depth(stamp_ns, frame_id, frame.depth_m))
        self._outlet.send(topics.camera_info, camera_info_message(stamp_ns, frame_id, frame.intrinsics))


class LidarPublisher:
    """Each cloud with all that the lidar tells of its points."""

    def __init__(
        self, outlet: Outlet, clock: Clock, lidar: Lidar, *, rate_hz: float = 10.0, topic: Topic = LIDAR
    ) -> None:
        self._outlet, self._topic = outlet, topic
        self._clouds = NewSamples(lidar.latest, Throttle(clock, 1.0 / rate_hz))

    def step(self) -> None:
        cloud: LidarCloud | None = self._clouds.take()
        if cloud is not None:
            self._outlet.send(self._topic, cloud_message(cloud))


class ImuSample(Protocol):
    """gyro_rad_s, acceleration_m_s2: (3,), IMU frame."""

    @property
    def stamp_ns(self) -> int: ...

    @property
    def gyro_rad_s(self) -> Array: ...

    @property
    def acceleration_m_s2(self) -> Array: ...


class ImuPublisher:
    """Every sample of an IMU since the last step, at its own rate: odometry and recordings need them all."""

    def __init__(
        self, outlet: Outlet, take: Callable[[], Sequence[ImuSample]], frame_id: str, *, topic: Topic = LIDAR_IMU
    ) -> None:
        self._outlet, self._take, self._frame_id, self._topic = outlet, take, frame_id, topic

    def step(self) -> None:
        for s in self._take():
            self._outlet.send(self._topic, imu_message(s.stamp_ns, self._frame_id, s.gyro_rad_s, s.acceleration_m_s2))


class DiagnosisPublisher:
    """What is wrong with a sensor, or that nothing is, once a second."""

    def __init__(self, outlet: Outlet, clock: Clock, diagnose: Callable[[], Sequence[Diagnosis]]) -> None:
        self._outlet, self._clock, self._diagnose = outlet, clock, diagnose
        self._throttle = Throttle(clock, DIAGNOSES_EVERY_S)

    def step(self) -> None:
        if self._throttle.due() and (diagnoses := self._diagnose()):
            self._outlet.send(DIAGNOSTICS, diagnostics_message(self._clock.now_ns(), diagnoses))


class MountPublisher:
    """Static transforms, (parent, child, (4, 4) T_parent_child) each, again and again."""

    def __init__(self, outlet: Outlet, clock: Clock, mounts: Sequence[tuple[str, str, Array]]) -> None:
        self._outlet, self._clock, self._mounts = outlet, clock, mounts
        self._throttle = Throttle(clock, MOUNTS_EVERY_S)

    def step(self) -> None:
        if self._throttle.due():
            self._outlet.send(TF_STATIC, transforms_message(self._clock.now_ns(), self._mounts))
