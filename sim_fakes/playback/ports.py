"""Camera, lidar, poses and map of a recording (not of a trial), played by a clock: hardware-in-the-loop's other half.

The recording begins when its first body is made; stamps are moved by as much, so that ages mean what they meant. What
came before the clock's now can be had, what came after cannot. At its end everything grows stale; it does not loop.
As with the real drivers, `take_frames`, `take_clouds` and `take_imu` give a recorder all that came since the last call.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from drivers.ports import CameraFrame, Clock, LidarCloud, PoseUnavailable, StaleData, StampedPose
from drivers.ros.clouds import cloud_of
from drivers.ros.convert import grid_of
from drivers.ros.messages import decode
from drivers.ros.transform_tree import TransformTree
from drivers.topics import IMU_TYPE
from logs.containers.recording import Recording
from logs.frames.reader import FrameReader, RecordingError
from logs.frames.surroundings import grid_from_what_was_seen
from logs.frames.topics import UNREAD_TYPES, unread
from logs.mcap_io.reader import LogMessage
from openbelief.arrays import Array
from openbelief.observation import RgbdFrame
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid
from sim_fakes.playback.imu import IMU_WORDS, RecordingImu
from sim_fakes.playback.roles import PlayedTopics, RoleUnclear
from sim_fakes.playback.timeline import NewestValue, TimeLine

CLOUD, GRID = "sensor_msgs/msg/PointCloud2", "nav_msgs/msg/OccupancyGrid"


class RecordingPorts:
    """The bodies of one recording, all on one time line. topics: which of its topics play which role.

    Raises LogError or RecordingError where it cannot be used.
    """

    def __init__(self, path: Path, topics: PlayedTopics | None = None) -> None:
        self._path, self._topics = path, topics or PlayedTopics()
        self._log = Recording(path)
        self._offset_ns: int | None = None

    @cached_property
    def _reader(self) -> FrameReader:
        return FrameReader(
            self._path,
            topics=self._topics.of_camera(self._kinds),
            pair_tolerance_s=self._topics.pair_tolerance_s,
            depth_offset_s=self._topics.depth_offset_s,
            max_tf_gap_s=self._topics.max_tf_gap_s,
        )

    @cached_property
    def start_ns(self) -> int:
        """The stamp of its first frame."""
        if not self._reader.plan.frames:
            raise RecordingError(f"{self._path.name} holds no usable RGB-D frame: {self._reader.why_nothing()}")
        if steps := self._reader.scan.epochs.steps:
            raise RecordingError(
                f"{self._path.name} cannot be played: its clock was set back by {steps[0].back_s:.2f} s "
                f"(from {steps[0].before_ns / 1e9:.3f}). It can be mapped; to play it, cut it there in two"
            )
        return self._reader.plan.frames[0].stamp_ns

    def camera(self, clock: Clock) -> RecordingCamera:
        """With an IMU where the recording holds the camera's."""
        line = self._line(clock)
        heads = self._reader.scan.images[str(self._reader.plan.topics.color)]
        frame_ids = {head.mark.stamp_ns: head.frame_id for head in heads}
        imu = self._imu("camera")
        if imu is None:
            return RecordingCamera(self._reader, frame_ids, line)
        return RecordingCameraWithImu(self._reader, frame_ids, line, imu)

    def lidar(self, clock: Clock) -> RecordingLidar:
        """With an IMU where the recording holds the lidar's."""
        topic = self._role("lidar", CLOUD)
        if topic is None:
            others = {t: (kind, "cdr") for t, kind in self._kinds.items() if kind in UNREAD_TYPES}
            raise RecordingError(
                f"{self._path.name} holds no lidar ({CLOUD}): take another body for that port.{unread(others)}"
            )
        clouds, line, imu = self._log.messages({topic}), self._line(clock), self._imu("lidar")
        return RecordingLidar(clouds, line) if imu is None else RecordingLidarWithImu(clouds, line, imu)

    def pose(self, clock: Clock) -> RecordingPoses:
        line = self._line(clock)
        return RecordingPoses(self._reader.scan.trees[0], line)

    def map(self, clock: Clock) -> RecordingMap | BuiltMap:
        """The recorded one; where there is none, a grid of all that the walk's lidar and depth camera saw."""
        topic = self._role("map", GRID)
        if topic is None:
            return BuiltMap(grid_from_what_was_seen(self._path))
        return RecordingMap(self._log.messages({topic}), self._line(clock))

    def _line(self, clock: Clock) -> TimeLine:
        if self._offset_ns is None:
            self._offset_ns = clock.now_ns() - self.start_ns
        return TimeLine(clock, self._offset_ns)

    def _role(self, role: str, type_name: str) -> str | None:
        try:
            return self._topics.one(role, self._of_type(type_name))
        except RoleUnclear as unclear:
            raise RecordingError(f"{self._path.name} {unclear}") from unclear

    def _imu(self, sensor: str) -> Iterator[LogMessage] | None:
        try:
            topic = self._topics.imu(sensor, self._of_type(IMU_TYPE), IMU_WORDS[sensor])
        except RoleUnclear as unclear:
            raise RecordingError(f"{self._path.name} {unclear}") from unclear
        return None if topic is None else self._log.messages({topic})

    def _of_type(self, type_name: str) -> list[str]:
        return sorted(topic for topic, kind in self._kinds.items() if kind == type_name)

    @cached_property
    def _kinds(self) -> dict[str, str]:
        return self._log.topics()


class RecordingCamera:
    """The Camera port: aligned frames of the recording, decoded as time passes."""

    def __init__(self, reader: FrameReader, frame_ids: dict[int, str], line: TimeLine) -> None:
        self._frame_ids, self._line = frame_ids, line
        self._newest: NewestValue[RgbdFrame] = NewestValue((frame.stamp_ns, frame) for frame in reader)

    def latest(self, max_age_s: float) -> CameraFrame:
        stamp_ns, frame = self._line.fresh("Camera", self._newest.at(self._line.now_ns()), max_age_s)
        return self._frame(stamp_ns, frame)

    def take_frames(self) -> list[CameraFrame]:
        taken = self._newest.take("Camera", self._line.now_ns())
        return [self._frame(stamp_ns + self._line.offset_ns, frame) for stamp_ns, frame in taken]

    def _frame(self, stamp_ns: int, frame: RgbdFrame) -> CameraFrame:
        frame_id = self._frame_ids[frame.stamp_ns]
        return CameraFrame(stamp_ns, frame.color, frame.depth_m, frame.intrinsics, frame_id)


class RecordingLidar:
    """The Lidar port."""

    def __init__(self, messages: Iterator[LogMessage], line: TimeLine) -> None:
        self._line = line
        clouds = (cloud_of(decode(message.payload, message.type_name)) for message in messages)
        self._newest: NewestValue[LidarCloud] = NewestValue((cloud.stamp_ns, cloud) for cloud in clouds)

    def latest(self, max_age_s: float) -> LidarCloud:
        stamp_ns, cloud = self._line.fresh("Lidar", self._newest.at(self._line.now_ns()), max_age_s)
        return replace(cloud, stamp_ns=stamp_ns)

    def take_clouds(self) -> list[LidarCloud]:
        taken = self._newest.take("Lidar", self._line.now_ns())
        return [replace(cloud, stamp_ns=stamp_ns + self._line.offset_ns) for stamp_ns, cloud in taken]


class RecordingCameraWithImu(RecordingCamera):
    def __init__(
        self, reader: FrameReader, frame_ids: dict[int, str], line: TimeLine, imu: Iterator[LogMessage]
    ) -> None:
        super().__init__(reader, frame_ids, line)
        self.imu = RecordingImu(imu, line)
        self.take_imu = self.imu.take_imu


class RecordingLidarWithImu(RecordingLidar):
    def __init__(self, messages: Iterator[LogMessage], line: TimeLine, imu: Iterator[LogMessage]) -> None:
        super().__init__(messages, line)
        self.imu = RecordingImu(imu, line)
        self.take_imu = self.imu.take_imu


class RecordingPoses:
    """The PoseSource port: the recording's transforms, up to now."""

    def __init__(self, tree: TransformTree, line: TimeLine) -> None:
        self._tree, self._line = tree, line

    def transform_at(self, stamp_ns: int, frame_id: str) -> Array:
        recorded_ns = stamp_ns - self._line.offset_ns
        if recorded_ns > self._line.now_ns():
            raise PoseUnavailable(f"The stamp lies {(recorded_ns - self._line.now_ns()) / 1e9:.3f} s in the future.")
        return self._tree.lookup(recorded_ns, "map", frame_id)

    def robot_pose(self, max_age_s: float) -> Pose2:
        return self.stamped_pose(max_age_s).pose

    def stamped_pose(self, max_age_s: float) -> StampedPose:
        try:
            last_ns = self._tree.newest_stamp("map", "base_link")
            at_ns = self._line.now_ns() if last_ns is None else min(last_ns, self._line.now_ns())
            pose = Pose2.from_matrix(self._tree.lookup(at_ns, "map", "base_link"))
            return StampedPose(*self._line.fresh("The robot's pose", (at_ns, pose), max_age_s))
        except PoseUnavailable as error:
            raise StaleData(f"The robot's pose: {error}") from error


@dataclass(frozen=True)
class BuiltMap:
    """The Map port of a site whose recording has no map: always the same grid."""

    grid: OccupancyGrid

    def latest(self) -> OccupancyGrid:
        return self.grid


class RecordingMap:
    """The Map port: the newest map; a latched one counts from the beginning."""

    def __init__(self, messages: Iterator[LogMessage], line: TimeLine) -> None:
        self._line = line
        grids = ((message.log_time_ns, grid_of(decode(message.payload, message.type_name))) for message in messages)
        first = next(grids, None)
        self._first = first[1] if first else None
        self._newest: NewestValue[OccupancyGrid] = NewestValue(grids)

    def latest(self) -> OccupancyGrid:
        found = self._newest.at(self._line.now_ns())
        grid = found[1] if found else self._first
        if grid is None:
            raise StaleData("Map: the recording has none.")
        return grid
