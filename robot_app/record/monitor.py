"""What an operator wants to see while recording: rates, drops, disk, coverage, and what is missing."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivers.ports import PortError
from logs.record.coverage import Coverage
from logs.record.port_tap import PortTap
from logs.record.queued import QueuedRecorder
from logs.record.recorder import McapRecorder
from logs.record.streams import RecordedStream
from logs.record.tap import TopicTap
from robot_app.app import Robot

LOOK_EVERY_S = 1.0
MAX_AGE_S = 2.0
SILENT_S, SILENT_STEPS = 10.0, 3.0  # silent is who sends nothing for so long, and so many times its longest pause


@dataclass(frozen=True)
class Taps:
    """Everything that feeds a recording: the ports that are asked, and the wires that are listened to."""

    ports: PortTap
    wires: tuple[TopicTap, ...] = ()

    @property
    def gone(self) -> list[str]:
        """What will not come again by itself, as sentences."""
        return [*self.ports.gone.values(), *(sentence for wire in self.wires if (sentence := wire.gone()))]


@dataclass(frozen=True)
class StreamStatus:
    """One topic. rate_hz: since the last status. The counts are those of logs.record.streams.Stream and Pace."""

    rate_hz: float
    written: int
    dropped: int
    reason: str
    lost: dict[str, int]
    holes: int
    longest_hole_s: float
    backwards: int

    def as_json(self) -> dict[str, Any]:
        return {
            "written": self.written,
            "dropped": self.dropped,
            "lost": self.lost,
            "holes": self.holes,
            "longest_hole_s": round(self.longest_hole_s, 3),
            "backwards": self.backwards,
        }


@dataclass(frozen=True)
class RecordingStatus:
    """A moment of a recording. coverage: 0 to 1 of `floor_m2`, None before there is a map. trouble: sentences.

    gone: those of them about a source that has ended, or fallen silent, before the recording did.
    """

    seconds: float
    streams: dict[str, StreamStatus]
    payload_bytes: int
    backlog_bytes: int
    free_bytes: int
    coverage: float | None
    floor_m2: float
    trouble: tuple[str, ...]
    gone: tuple[str, ...] = ()

    @property
    def dropped(self) -> int:
        return sum(stream.dropped for stream in self.streams.values())

    @property
    def lost(self) -> int:
        """Before they came to the recorder: images, clouds, samples, packets."""
        return sum(sum(stream.lost.values()) for stream in self.streams.values())

    @property
    def written(self) -> int:
        return sum(stream.written for stream in self.streams.values())

    def as_json(self) -> dict[str, Any]:
        return {
            "seconds": round(self.seconds, 2),
            "messages": self.written,
            "dropped": self.dropped,
            "lost": self.lost,
            "streams": {name: stream.as_json() for name, stream in self.streams.items()},
            "trouble": list(self.trouble),
            "gone": list(self.gone),
            "coverage": None if self.coverage is None else round(self.coverage, 3),
            "floor_m2": round(self.floor_m2, 1),
        }


class RecordingMonitor:
    """Reads the recording's counts, and the robot's own ports for coverage once a second."""

    def __init__(self, robot: Robot, queue: QueuedRecorder, recorder: McapRecorder, taps: Taps) -> None:
        self._robot, self._queue, self._recorder, self._taps = robot, queue, recorder, taps
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

    def status(self) -> RecordingStatus:
        """Now; rates count from the call before."""
        now_ns = self._robot.clock.now_ns()
        streams = {name: self._stream(name, now_ns) for name in sorted(self._queue.streams)}
        self._last_ns = now_ns
        self._before = {name: stream.written for name, stream in streams.items()}
        gone = [*self._taps.gone, *self._silent(now_ns)]
        trouble = [*gone, *self._taps.ports.trouble.values(), self._blind, self._recorder.failure or ""]
        return RecordingStatus(
            seconds=(now_ns - self._begin_ns) / 1e9,
            streams=streams,
            payload_bytes=sum(stream.bytes for stream in self._queue.streams.values()),
            backlog_bytes=self._queue.backlog_bytes,
            free_bytes=shutil.disk_usage(self._folder).free,
            coverage=self._coverage.share if self._coverage else None,
            floor_m2=self._coverage.free_m2 if self._coverage else 0.0,
            trouble=tuple(dict.fromkeys(sentence for sentence in trouble if sentence)),
            gone=tuple(dict.fromkeys(gone)),
        )

    def _silent(self, now_ns: int) -> list[str]:
        """Of the topics that came: those from which nothing comes any more."""
        return [
            f"nothing on {name} for {silent_s:.0f} s"
            for name, stream in sorted(self._queue.streams.items())
            if (silent_s := _silent_s(stream, now_ns)) and name not in self._taps.ports.gone
        ]

    def _stream(self, name: str, now_ns: int) -> StreamStatus:
        stream, elapsed_s = self._queue.streams[name], (now_ns - self._last_ns) / 1e9
        new = stream.written - self._before.get(name, 0)
        return StreamStatus(
            rate_hz=new / elapsed_s if elapsed_s else 0.0,
            written=stream.written,
            dropped=stream.dropped,
            reason=stream.reason,
            lost=dict(stream.lost),
            holes=stream.pace.holes,
            longest_hole_s=stream.pace.longest_hole_s,
            backwards=stream.pace.backwards,
        )


def _silent_s(stream: RecordedStream, now_ns: int) -> float | None:
    """For how long, None where that is no more than its way."""
    if stream.taken_ns is None or not stream.lasting:
        return None
    silent_s = (now_ns - stream.taken_ns) / 1e9
    return silent_s if silent_s > max(SILENT_S, SILENT_STEPS * stream.pace.longest_step_s) else None
