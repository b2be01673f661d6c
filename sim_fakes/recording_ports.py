"""Camera, lidar, poses and map of a recording (not of a trial), played by a clock: hardware-in-the-loop's other half.

The recording begins when its first body is made; stamps are moved by as much, so that ages mean what they meant. What
came before the clock's now can be had, what came after cannot. At its end everything grows stale; it does not loop.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Generic, TypeVar

from drivers.ports import CameraFrame, Clock, LidarCloud, PoseUnavailable, StaleData
from drivers.ros_clouds import cloud_of
from drivers.ros_convert import grid_of
from drivers.ros_messages import decode
from logs.frame_plan import RecordingError, Scan, scan
from logs.frames import FrameReader
from logs.reader import LogMessage, LogReader
from logs.surroundings import grid_from_what_was_seen
from openbelief.arrays import Array
from openbelief.observation import RgbdFrame
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid

CLOUD, GRID = "sensor_msgs/msg/PointCloud2", "nav_msgs/msg/OccupancyGrid"
MAX_TF_GAP_S = 0.25
Value = TypeVar("Value")


class RecordingPorts:
    """The bodies of one recording, all on one time line. Raises LogError or RecordingError where it cannot be used."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._reader = FrameReader(path, max_tf_gap_s=MAX_TF_GAP_S)
        self._offset_ns: int | None = None

    @cached_property
    def start_ns(self) -> int:
        """The stamp of its first frame."""
        if not self._reader.plan.frames:
            raise RecordingError(f"{self._path.name} holds no usable RGB-D frame: {dict(self._reader.skipped)}")
        return self._reader.plan.frames[0].stamp_ns

    def camera(self, clock: Clock) -> RecordingCamera:
        frame_ids = dict(self._scan.color[str(self._reader.plan.topics.color)])
        return RecordingCamera(self._reader, frame_ids, self._line(clock))

    def lidar(self, clock: Clock) -> RecordingLidar:
        return RecordingLidar(self._messages(CLOUD, "lidar"), self._line(clock))

    def pose(self, clock: Clock) -> RecordingPoses:
        return RecordingPoses(self._scan, self._line(clock))

    def map(self, clock: Clock) -> RecordingMap | BuiltMap:
        """The recorded one; where there is none, a grid of all that the walk's lidar and depth camera saw."""
        if GRID not in LogReader(self._path, prefix=True).topics().values():
            return BuiltMap(grid_from_what_was_seen(self._path))
        return RecordingMap(self._messages(GRID, "map"), self._line(clock))

    @cached_property
    def _scan(self) -> Scan:
        return scan(LogReader(self._path, prefix=True), MAX_TF_GAP_S)

    def _line(self, clock: Clock) -> TimeLine:
        if self._offset_ns is None:
            self._offset_ns = clock.now_ns() - self.start_ns
        return TimeLine(clock, self._offset_ns)

    def _messages(self, type_name: str, what: str) -> Iterator[LogMessage]:
        log = LogReader(self._path, prefix=True)
        topics = sorted(topic for topic, kind in log.topics().items() if kind == type_name)
        if not topics:
            raise RecordingError(f"{self._path.name} holds no {what} ({type_name}): take another body for that port")
        return log.messages({topics[0]})


class TimeLine:
    """The recording's time at the clock's now, and ages by it."""

    def __init__(self, clock: Clock, offset_ns: int) -> None:
        self._clock, self.offset_ns = clock, offset_ns

    def now_ns(self) -> int:
        return self._clock.now_ns() - self.offset_ns

    def fresh(self, what: str, found: tuple[int, Value] | None, max_age_s: float) -> tuple[int, Value]:
        """What was found, with its stamp on the clock's time line; raises StaleData."""
        if found is None:
            raise StaleData(f"{what}: the recording has none yet.")
        stamp_ns, value = found
        age_s = (self.now_ns() - stamp_ns) / 1e9
        if age_s > max_age_s:
            raise StaleData(f"{what}: the recording's newest is {age_s:.2f} s old, more than {max_age_s:g} s.")
        return stamp_ns + self.offset_ns, value


class Newest(Generic[Value]):
    """The newest of a stream of (stamp_ns, value) at a time that only grows; holds two values. Thread-safe."""

    def __init__(self, stream: Iterator[tuple[int, Value]]) -> None:
        self._stream, self._lock = stream, threading.Lock()
        self._now: tuple[int, Value] | None = None
        self._ahead = next(stream, None)

    def at(self, now_ns: int) -> tuple[int, Value] | None:
        with self._lock:
            while self._ahead is not None and self._ahead[0] <= now_ns:
                self._now, self._ahead = self._ahead, next(self._stream, None)
            return self._now


class RecordingCamera:
    """The Camera port: aligned frames of the recording, decoded as time passes."""

    def __init__(self, reader: FrameReader, frame_ids: dict[int, str], line: TimeLine) -> None:
        self._frame_ids, self._line = frame_ids, line
        self._newest: Newest[RgbdFrame] = Newest((frame.stamp_ns, frame) for frame in reader)

    def latest(self, max_age_s: float) -> CameraFrame:
        stamp_ns, frame = self._line.fresh("Camera", self._newest.at(self._line.now_ns()), max_age_s)
        frame_id = self._frame_ids[frame.stamp_ns]
        return CameraFrame(stamp_ns, frame.color, frame.depth_m, frame.intrinsics, frame_id)


class RecordingLidar:
    """The Lidar port."""

    def __init__(self, messages: Iterator[LogMessage], line: TimeLine) -> None:
        self._line = line
        clouds = (cloud_of(decode(message.payload, message.type_name)) for message in messages)
        self._newest: Newest[LidarCloud] = Newest((cloud.stamp_ns, cloud) for cloud in clouds)

    def latest(self, max_age_s: float) -> LidarCloud:
        stamp_ns, cloud = self._line.fresh("Lidar", self._newest.at(self._line.now_ns()), max_age_s)
        return replace(cloud, stamp_ns=stamp_ns)


class RecordingPoses:
    """The PoseSource port: the recording's transforms, up to now."""

    def __init__(self, found: Scan, line: TimeLine) -> None:
        self._tree, self._line = found.tree, line

    def transform_at(self, stamp_ns: int, frame_id: str) -> Array:
        recorded_ns = stamp_ns - self._line.offset_ns
        if recorded_ns > self._line.now_ns():
            raise PoseUnavailable(f"The stamp lies {(recorded_ns - self._line.now_ns()) / 1e9:.3f} s in the future.")
        return self._tree.lookup(recorded_ns, "map", frame_id)

    def robot_pose(self, max_age_s: float) -> Pose2:
        try:
            last_ns = self._tree.newest_stamp("map", "base_link")
            at_ns = self._line.now_ns() if last_ns is None else min(last_ns, self._line.now_ns())
            pose = Pose2.from_matrix(self._tree.lookup(at_ns, "map", "base_link"))
            return self._line.fresh("The robot's pose", (at_ns, pose), max_age_s)[1]
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
        self._newest: Newest[OccupancyGrid] = Newest(grids)

    def latest(self) -> OccupancyGrid:
        found = self._newest.at(self._line.now_ns())
        grid = found[1] if found else self._first
        if grid is None:
            raise StaleData("Map: the recording has none.")
        return grid
