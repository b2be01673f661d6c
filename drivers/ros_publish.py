"""Camera and lidar as ROS topics on Zenoh, for a robot without those ROS nodes: the other end of ros_topics.py."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from drivers.bridge_keys import BridgeKeys
from drivers.ports import Camera, CameraFrame, Clock, Lidar, LidarCloud, StaleData
from drivers.ros_clouds import cloud_message
from drivers.ros_convert import (
    camera_info_message,
    color_message,
    depth_message,
    depth_png_message,
    jpeg_message,
    transforms_message,
)
from drivers.ros_messages import Message, encode
from drivers.topics import CAMERA_INFO, COLOR_JPEG, DEPTH_PNG, LIDAR, TF_STATIC, Topic
from drivers.zenoh_link import ZenohLink
from openbelief.arrays import Array

Sample = TypeVar("Sample", CameraFrame, LidarCloud)

MOUNTS_EVERY_S = 1.0  # repeated, so that who comes late has them too
MAX_AGE_S = 0.5  # an older sample of a sensor is not worth sending


@dataclass(frozen=True)
class CameraTopics:
    """Under which names a camera is published; the type (raw or compressed) follows the topic's."""

    color: Topic = COLOR_JPEG
    depth: Topic = DEPTH_PNG
    camera_info: Topic = CAMERA_INFO


@dataclass
class Rate:
    """Lets through one in `period_s` by the clock, whatever comes."""

    period_s: float
    due_ns: int = 0

    def due(self, now_ns: int) -> bool:
        if now_ns < self.due_ns:
            return False
        self.due_ns = max(self.due_ns + round(self.period_s * 1e9), now_ns)
        return True


class SensorPublisher:
    """`step` sends what is new and due; call it more often than the fastest rate.

    A sensor without fresh data sends nothing (its age tells the workstation); one that failed raises LinkLost.
    """

    def __init__(
        self,
        link: ZenohLink,
        clock: Clock,
        keys: BridgeKeys | None = None,
        *,
        camera: Camera | None = None,
        lidar: Lidar | None = None,
        camera_rate_hz: float = 15.0,
        lidar_rate_hz: float = 10.0,
        mounts: Sequence[tuple[str, str, Array]] = (),
        camera_topics: CameraTopics | None = None,
        lidar_topic: Topic = LIDAR,
    ) -> None:
        self._link, self._clock, self._keys = link, clock, keys or BridgeKeys()
        self._camera, self._lidar, self._mounts = camera, lidar, mounts
        self._rates = {name: Rate(1.0 / hz) for name, hz in (("camera", camera_rate_hz), ("lidar", lidar_rate_hz))}
        self._rates["mounts"] = Rate(MOUNTS_EVERY_S)
        self._camera_topics, self._lidar_topic = camera_topics or CameraTopics(), lidar_topic
        self._newest = {"camera": 0, "lidar": 0}
        self.sent: Counter[str] = Counter()  # messages so far, by topic

    def step(self) -> None:
        if self._camera is not None and (frame := self._new("camera", self._camera.latest)):
            self._send_frame(frame)
        if self._lidar is not None and (cloud := self._new("lidar", self._lidar.latest)):
            self._send(self._lidar_topic, cloud_message(cloud))
        if self._mounts and self._rates["mounts"].due(self._clock.now_ns()):
            self._send(TF_STATIC, transforms_message(self._clock.now_ns(), self._mounts))

    def _new(self, name: str, latest: Callable[[float], Sample]) -> Sample | None:
        """The newest sample where it was not sent yet and is due."""
        try:
            sample = latest(MAX_AGE_S)
        except StaleData:
            return None
        if sample.stamp_ns <= self._newest[name] or not self._rates[name].due(self._clock.now_ns()):
            return None
        self._newest[name] = sample.stamp_ns
        return sample

    def _send_frame(self, frame: CameraFrame) -> None:
        topics, stamp_ns, frame_id = self._camera_topics, frame.stamp_ns, frame.frame_id
        color = jpeg_message if topics.color.type_name == COLOR_JPEG.type_name else color_message
        depth = depth_png_message if topics.depth.type_name == DEPTH_PNG.type_name else depth_message
        self._send(topics.color, color(stamp_ns, frame_id, frame.color))
        self._send(topics.depth, depth(stamp_ns, frame_id, frame.depth_m))
        self._send(topics.camera_info, camera_info_message(stamp_ns, frame_id, frame.intrinsics))

    def _send(self, topic: Topic, message: Message) -> None:
        self._link.put(self._keys.topic(topic), encode(message), drop=True)
        self.sent[topic.name] += 1
