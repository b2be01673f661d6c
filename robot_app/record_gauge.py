"""What an operator wants to see while recording: rates, drops, disk, coverage, and what is missing."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivers.ports import PortError
from logs.coverage import Coverage
from logs.port_tap import PortTap
from logs.queued import QueuedRecorder
from logs.recorder import McapRecorder
from robot_app.app import Robot

LOOK_EVERY_S = 1.0
MAX_AGE_S = 2.0


@dataclass(frozen=True)
class StreamStatus:
    """One topic. rate_hz: since the last status."""

    rate_hz: float
    written: int
    dropped: int
    reason: str


@dataclass(frozen=True)
class Status:
    """A moment of a recording. coverage: 0 to 1 of `floor_m2`, None before there is a map. trouble: sentences."""

    seconds: float
    streams: dict[str, StreamStatus]
    payload_bytes: int
    backlog_bytes: int
    free_bytes: int
    coverage: float | None
    floor_m2: float
    trouble: tuple[str, ...]

    @property
    def dropped(self) -> int:
        return sum(stream.dropped for stream in self.streams.values())

    @property
    def written(self) -> int:
        return sum(stream.written for stream in self.streams.values())

    def as_json(self) -> dict[str, Any]:
        return {
            "seconds": round(self.seconds, 2),
            "messages": self.written,
            "dropped": self.dropped,
            "streams": {name: {"written": s.written, "dropped": s.dropped} for name, s in self.streams.items()},
            "coverage": None if self.coverage is None else round(self.coverage, 3),
            "floor_m2": round(self.floor_m2, 1),
        }


class Gauge:
    """Reads the recording's counts, and the robot's own ports for coverage once a second."""

    def __init__(self, robot: Robot, queue: QueuedRecorder, recorder: McapRecorder, tap: PortTap) -> None:
        self._robot, self._queue, self._recorder, self._tap = robot, queue, recorder, tap
        self._folder: Path = recorder.path.parent
        self._begin_ns = self._last_ns = self._looked_ns = robot.clock.now_ns()
        self._before: dict[str, int] = {}
        self._coverage: Coverage | None = None
        self._blind = ""

    def look(self) -> None:
        """Mark what the camera has just measured; at most once a second, since decoding an image costs."""
        now_ns = self._robot.clock.now_ns()
        if now_ns - self._looked_ns < LOOK_EVERY_S * 1e9:
            return
        self._looked_ns = now_ns
        try:
            self._coverage = self._coverage or Coverage(self._robot.map.latest())
            frame = self._robot.camera.latest(MAX_AGE_S)
            T_map_camera = self._robot.poses.transform_at(frame.stamp_ns, frame.frame_id)
        except PortError as error:
            self._blind = str(error)
            return
        self._blind = ""
        self._coverage.look(frame.depth_m, frame.intrinsics, T_map_camera)

    def status(self) -> Status:
        """Now; rates count from the call before."""
        now_ns = self._robot.clock.now_ns()
        streams = {name: self._stream(name, now_ns) for name in sorted(self._queue.streams)}
        self._last_ns = now_ns
        self._before = {name: stream.written for name, stream in streams.items()}
        trouble = [*self._tap.trouble.values(), self._blind, self._recorder.failure or ""]
        return Status(
            seconds=(now_ns - self._begin_ns) / 1e9,
            streams=streams,
            payload_bytes=sum(stream.bytes for stream in self._queue.streams.values()),
            backlog_bytes=self._queue.backlog_bytes,
            free_bytes=shutil.disk_usage(self._folder).free,
            coverage=self._coverage.share if self._coverage else None,
            floor_m2=self._coverage.free_m2 if self._coverage else 0.0,
            trouble=tuple(dict.fromkeys(sentence for sentence in trouble if sentence)),
        )

    def _stream(self, name: str, now_ns: int) -> StreamStatus:
        stream, elapsed_s = self._queue.streams[name], (now_ns - self._last_ns) / 1e9
        new = stream.written - self._before.get(name, 0)
        return StreamStatus(new / elapsed_s if elapsed_s else 0.0, stream.written, stream.dropped, stream.reason)
