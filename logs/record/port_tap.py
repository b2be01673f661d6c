"""Sensors that are no topics (a driver of this process, a recording played again) into a recording, as topics.

Who drains a queue (`take_frames`, `take_clouds`, `take_imu`) is asked for all of it, and all of it is written, whatever
its stamps; of the others the newest is taken when it is another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

from drivers.ports import (
    Camera,
    CameraFrame,
    Lidar,
    LidarCloud,
    LinkLost,
    Map,
    PortError,
    PoseSource,
    PoseUnavailable,
    StaleData,
)
from drivers.ros.clouds import cloud_message
from drivers.ros.convert import grid_message, imu_message, transforms_message
from drivers.ros.image_messages import camera_info_message, depth_message, jpeg_message
from drivers.ros.messages import Message, encode
from drivers.topics import CAMERA_IMU, CAMERA_INFO, COLOR_JPEG, DEPTH, LIDAR, LIDAR_IMU, MAP, TF, Topic
from logs.record.driver_losses import CameraLosses, CloudLosses, ImuLosses, TakesImu
from logs.record.queued import Cdr, QueuedRecorder
from openbelief.traversability import OccupancyGrid

MAX_AGE_S = 1.0
UNPOSED = "without a transform at the stamp of an image or a cloud"
CAMERA_IMU_FRAME, LIDAR_IMU_FRAME, BASE_FRAME = "camera_imu_optical_frame", "livox_frame", "base_link"


@runtime_checkable
class TakesFrames(Protocol):
    def take_frames(self) -> Sequence[CameraFrame]: ...


@runtime_checkable
class TakesClouds(Protocol):
    def take_clouds(self) -> Sequence[LidarCloud]: ...


class PortTap:
    """`poll()` some fifty times a second. `trouble`: what a port said when it could not answer, by topic.

    `gone`: those of them that will not answer again.
    """

    def __init__(self, queue: QueuedRecorder) -> None:
        self._queue = queue
        self._pollers: list[tuple[str, Callable[[], None]]] = []
        self._posed = False
        self._unposed: list[tuple[int, str]] = []  # (stamp_ns, frame_id) of what was written since the last poll
        self.trouble: dict[str, str] = {}
        self.gone: dict[str, str] = {}

    def poll(self) -> None:
        """Write what is new. A port that cannot answer is told of, the others go on."""
        for name, poller in self._pollers:
            try:
                poller()
                self.trouble.pop(name, None)
                self.gone.pop(name, None)
            except PortError as error:
                self.trouble[name] = str(error)
                if isinstance(error, LinkLost):
                    self.gone[name] = str(error)

    def add_camera(self, camera: Camera, *, lasting: bool = False) -> None:
        """RGB-D, calibration and, where the body has one, the IMU. lasting: as in logs.record.streams.Stream."""
        losses = CameraLosses(camera)
        self._add(DEPTH, self._poller(DEPTH, _frames(camera), self._frame, losses), lasting=lasting)
        if isinstance(camera, TakesImu):
            self._add(CAMERA_IMU, self._imu(camera, CAMERA_IMU, CAMERA_IMU_FRAME), lasting=lasting)

    def add_lidar(self, lidar: Lidar, *, lasting: bool = False) -> None:
        """Clouds and, where the body has one, the IMU."""
        losses = CloudLosses(lidar)
        self._add(LIDAR, self._poller(LIDAR, _clouds(lidar), self._cloud, losses), lasting=lasting)
        if isinstance(lidar, TakesImu):
            self._add(LIDAR_IMU, self._imu(lidar, LIDAR_IMU, LIDAR_IMU_FRAME), lasting=lasting)

    def add_map(self, grid: Map) -> None:
        """The navigation map, whenever it changes."""
        last: list[OccupancyGrid] = []

        def poll() -> None:
            newest = grid.latest()
            if not last or newest is not last[0]:
                last[:] = [newest]
                self._offer(MAP, newest.stamp_ns, newest.cells.nbytes, lambda: grid_message(newest))

        self._add(MAP, poll)

    def add_poses(self, poses: PoseSource, *elsewhere: Camera | Lidar) -> None:
        """Where the robot and its sensors were in the map, at the stamp of every image and cloud of this tap.

        elsewhere: sensors that are recorded by another way, whose newest stamp counts.
        """
        self._posed = True
        seen: dict[str, int] = {}

        def poll() -> None:
            for sensor in elsewhere:
                self._note_newest(sensor, seen)
            unposed, self._unposed = self._unposed, []
            for at in unposed:
                self._poses(poses, *at)

        self._add(TF, poll)

    def _note_newest(self, sensor: Camera | Lidar, seen: dict[str, int]) -> None:
        try:
            newest = sensor.latest(MAX_AGE_S)
        except StaleData:
            return  # the silence is told of elsewhere
        if newest.stamp_ns != seen.get(newest.frame_id):
            self._unposed.append((newest.stamp_ns, newest.frame_id))
            seen[newest.frame_id] = newest.stamp_ns

    def _poses(self, poses: PoseSource, stamp_ns: int, frame_id: str) -> None:
        try:
            edges = [("map", frame, poses.transform_at(stamp_ns, frame)) for frame in (BASE_FRAME, frame_id)]
        except PoseUnavailable:
            lost = self._queue.stream(TF.name).lost
            lost[UNPOSED] = lost.get(UNPOSED, 0) + 1
            return
        self._offer(TF, stamp_ns, 256, lambda: transforms_message(stamp_ns, edges))

    def _add(self, topic: Topic, poller: Callable[[], None], *, lasting: bool = False) -> None:
        self._queue.stream(topic.name).lasting = lasting
        self._pollers.append((topic.name, poller))

    def _poller(
        self,
        topic: Topic,
        take: Callable[[], Sequence[Any]],
        write: Callable[[Any], None],
        losses: CameraLosses | CloudLosses,
    ) -> Callable[[], None]:
        """Writes all that there is to take, and tells what its driver lost, also where it answers no more."""
        stream = self._queue.stream(topic.name)

        def poll() -> None:
            try:
                values = take()
                losses.took(values)
                for value in values:
                    write(value)
                    if self._posed:
                        self._unposed.append((value.stamp_ns, value.frame_id))
            finally:
                stream.lost = losses.look()

        return poll

    def _frame(self, frame: CameraFrame) -> None:
        stamp_ns, name = frame.stamp_ns, frame.frame_id
        self._offer(COLOR_JPEG, stamp_ns, frame.color.nbytes, lambda: jpeg_message(stamp_ns, name, frame.color))
        self._offer(DEPTH, stamp_ns, frame.depth_m.nbytes, lambda: depth_message(stamp_ns, name, frame.depth_m))
        self._offer(CAMERA_INFO, stamp_ns, 512, lambda: camera_info_message(stamp_ns, name, frame.intrinsics))

    def _cloud(self, cloud: LidarCloud) -> None:
        self._offer(LIDAR, cloud.stamp_ns, cloud.points.nbytes, lambda: cloud_message(cloud))

    def _imu(self, sensor: TakesImu, topic: Topic, frame_id: str) -> Callable[[], None]:
        losses, stream = ImuLosses(sensor), self._queue.stream(topic.name)

        def poll() -> None:
            try:
                for sample in losses.take():
                    self._offer(topic, sample.stamp_ns, 512, _imu_maker(sample, frame_id))
            finally:
                stream.lost = losses.look()

        return poll

    def _offer(self, topic: Topic, stamp_ns: int, size: int, make: Callable[[], Message]) -> None:
        self._queue.offer(topic.name, size, lambda: Cdr(topic.name, topic.type_name, stamp_ns, encode(make())))


def _imu_maker(sample: Any, frame_id: str) -> Callable[[], Message]:
    """frame_id: of samples that do not name their own."""
    frame = getattr(sample, "frame_id", frame_id)
    return lambda: imu_message(sample.stamp_ns, frame, sample.gyro_rad_s, sample.acceleration_m_s2)


def _frames(camera: Camera) -> Callable[[], Sequence[CameraFrame]]:
    return camera.take_frames if isinstance(camera, TakesFrames) else _another(camera.latest)


def _clouds(lidar: Lidar) -> Callable[[], Sequence[LidarCloud]]:
    return lidar.take_clouds if isinstance(lidar, TakesClouds) else _another(lidar.latest)


def _another(latest: Callable[[float], Any]) -> Callable[[], Sequence[Any]]:
    """The newest, where its stamp is not the one of the last call."""
    last: list[int] = []

    def take() -> Sequence[Any]:
        newest = latest(MAX_AGE_S)
        if [newest.stamp_ns] == last:
            return ()
        last[:] = [newest.stamp_ns]
        return (newest,)

    return take
