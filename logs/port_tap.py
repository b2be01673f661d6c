"""Sensors that are no topics (a driver of this process, a recording played again) into a recording, as topics.

Who drains a queue (`take_frames`, `take_clouds`, `take_imu`) is asked for all of it; of the others the newest is taken.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Protocol, runtime_checkable

from drivers.ports import Camera, CameraFrame, Lidar, LidarCloud, Map, PortError, PoseSource, StaleData
from drivers.ros_clouds import cloud_message
from drivers.ros_convert import (
    camera_info_message,
    depth_message,
    grid_message,
    imu_message,
    jpeg_message,
    transforms_message,
)
from drivers.ros_messages import Message, encode
from drivers.topics import CAMERA_IMU, CAMERA_INFO, COLOR_JPEG, DEPTH, LIDAR, LIDAR_IMU, MAP, TF, Topic
from logs.queued import Cdr, QueuedRecorder
from openbelief.traversability import OccupancyGrid

MAX_AGE_S = 1.0
CAMERA_IMU_FRAME, LIDAR_IMU_FRAME, BASE_FRAME = "camera_imu_optical_frame", "livox_frame", "base_link"


@runtime_checkable
class TakesFrames(Protocol):
    def take_frames(self) -> Sequence[CameraFrame]: ...


@runtime_checkable
class TakesClouds(Protocol):
    def take_clouds(self) -> Sequence[LidarCloud]: ...


@runtime_checkable
class TakesImu(Protocol):
    def take_imu(self) -> Sequence[Any]: ...


class PortTap:
    """`poll()` some fifty times a second. `trouble`: what a port said when it could not answer, by topic."""

    def __init__(self, queue: QueuedRecorder) -> None:
        self._queue = queue
        self._pollers: list[tuple[str, Callable[[], None]]] = []
        self._newest: dict[str, int] = {}
        self.trouble: dict[str, str] = {}

    def poll(self) -> None:
        """Write what is new. A port that cannot answer is told of, the others go on."""
        for name, poller in self._pollers:
            try:
                poller()
                self.trouble.pop(name, None)
            except PortError as error:
                self.trouble[name] = str(error)

    def add_camera(self, camera: Camera) -> None:
        """RGB-D, calibration and, where the body has one, the IMU."""
        self._add(DEPTH, lambda: self._each("camera", _frames(camera), self._frame))
        if isinstance(camera, TakesImu):
            self._add(CAMERA_IMU, self._imu(camera, CAMERA_IMU, CAMERA_IMU_FRAME))

    def add_lidar(self, lidar: Lidar) -> None:
        """Clouds and, where the body has one, the IMU."""
        self._add(LIDAR, lambda: self._each("lidar", _clouds(lidar), self._cloud))
        if isinstance(lidar, TakesImu):
            self._add(LIDAR_IMU, self._imu(lidar, LIDAR_IMU, LIDAR_IMU_FRAME))

    def add_map(self, grid: Map) -> None:
        """The navigation map, whenever it changes."""
        last: list[OccupancyGrid] = []

        def poll() -> None:
            newest = grid.latest()
            if not last or newest is not last[0]:
                last[:] = [newest]
                self._offer(MAP, newest.stamp_ns, newest.cells.nbytes, lambda: grid_message(newest))

        self._add(MAP, poll)

    def add_poses(self, poses: PoseSource, camera: Camera, lidar: Lidar) -> None:
        """Where the robot, the camera and the lidar were in the map, at the stamp of every image and cloud."""
        seen: dict[str, int] = {}

        def poll() -> None:
            for sensor in (camera, lidar):
                try:
                    newest = sensor.latest(MAX_AGE_S)
                except StaleData:
                    continue  # its own poller tells of it
                if newest.stamp_ns > seen.get(newest.frame_id, 0):
                    self._poses(poses, newest.stamp_ns, newest.frame_id)
                    seen[newest.frame_id] = newest.stamp_ns

        self._add(TF, poll)

    def _poses(self, poses: PoseSource, stamp_ns: int, frame_id: str) -> None:
        edges = [("map", frame, poses.transform_at(stamp_ns, frame)) for frame in (BASE_FRAME, frame_id)]
        self._offer(TF, stamp_ns, 256, lambda: transforms_message(stamp_ns, edges))

    def _add(self, topic: Topic, poller: Callable[[], None]) -> None:
        self._queue.stream(topic.name)
        self._pollers.append((topic.name, poller))

    def _each(self, sensor: str, values: Iterable[Any], write: Callable[[Any], None]) -> None:
        for value in values:
            if value.stamp_ns > self._newest.get(sensor, -1):
                self._newest[sensor] = value.stamp_ns
                write(value)

    def _frame(self, frame: CameraFrame) -> None:
        stamp_ns, name = frame.stamp_ns, frame.frame_id
        self._offer(COLOR_JPEG, stamp_ns, frame.color.nbytes, lambda: jpeg_message(stamp_ns, name, frame.color))
        self._offer(DEPTH, stamp_ns, frame.depth_m.nbytes, lambda: depth_message(stamp_ns, name, frame.depth_m))
        self._offer(CAMERA_INFO, stamp_ns, 512, lambda: camera_info_message(stamp_ns, name, frame.intrinsics))

    def _cloud(self, cloud: LidarCloud) -> None:
        self._offer(LIDAR, cloud.stamp_ns, cloud.points.nbytes, lambda: cloud_message(cloud))

    def _imu(self, sensor: TakesImu, topic: Topic, frame_id: str) -> Callable[[], None]:
        def poll() -> None:
            for sample in sensor.take_imu():
                make = _imu_maker(sample, frame_id)
                self._offer(topic, sample.stamp_ns, 512, make)

        return poll

    def _offer(self, topic: Topic, stamp_ns: int, size: int, make: Callable[[], Message]) -> None:
        self._queue.offer(topic.name, size, lambda: Cdr(topic.name, topic.type_name, stamp_ns, encode(make())))


def _imu_maker(sample: Any, frame_id: str) -> Callable[[], Message]:
    return lambda: imu_message(sample.stamp_ns, frame_id, sample.gyro_rad_s, sample.acceleration_m_s2)


def _frames(camera: Camera) -> Sequence[CameraFrame]:
    return camera.take_frames() if isinstance(camera, TakesFrames) else [camera.latest(MAX_AGE_S)]


def _clouds(lidar: Lidar) -> Sequence[LidarCloud]:
    return lidar.take_clouds() if isinstance(lidar, TakesClouds) else [lidar.latest(MAX_AGE_S)]
