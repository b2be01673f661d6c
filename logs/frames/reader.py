"""A ROS 2 MCAP recording as posed RGB-D frames: what is missing, stale or unreadable is skipped and counted."""

from __future__ import annotations

import hashlib
import os
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path

from drivers.ros.convert import grid_of
from drivers.ros.images import ImageRefused, color_image, depth_image
from drivers.ros.messages import Message, WireError, decode, stamp_to_ns
from logs.frames.plan import (
    FramePlan,
    PlannedFrame,
    PlanOptions,
    RecordingError,
    RecordingTopics,
    Skip,
    SkipFrame,
    plan_frames,
    scan,
)
from logs.mcap_io.reader import LogReader
from openbelief.observation import RgbdFrame
from openbelief.surroundings import StoreyMap

__all__ = ["FrameReader", "RecordingError", "RecordingTopics", "recording_id"]

ID_WINDOW_BYTES = 1 << 20


class FrameReader:
    """Iterate to get the frames, in the order of the file; afterwards `skips` says what was left out.

    The header's stamp counts, never the time of logging. max_tf_gap_s: the longest time between two transforms that
    may be interpolated. pair_tolerance_s: how far a depth image's or a calibration's stamp may be from the colour's.
    A truncated or damaged file gives what lies before the damage, and `damage` says so. Raises LogError where the file
    is no recording, RecordingError where a kind of topic is missing or unclear.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        topics: RecordingTopics | None = None,
        map_frame: str = "map",
        stride: int = 1,
        max_tf_gap_s: float = 0.25,
        pair_tolerance_s: float = 0.005,
    ) -> None:
        self.path = Path(path)
        self._log = LogReader(self.path, prefix=True)
        self._options = PlanOptions(topics or RecordingTopics(), map_frame, stride, pair_tolerance_s)
        self._max_tf_gap_s = max_tf_gap_s
        self._plan: FramePlan | None = None
        self._refused: dict[int, Skip] = {}  # by index: what only decoding found

    @property
    def recording(self) -> str:
        """The recording's id: `recording_id`."""
        return recording_id(self.path)

    @property
    def plan(self) -> FramePlan:
        """Frames to come and images skipped so far; the first use reads through the file."""
        if self._plan is None:
            self._plan = plan_frames(scan(self._log, self._max_tf_gap_s), self._options, self.path.name)
        return self._plan

    @property
    def skips(self) -> list[Skip]:
        """Every colour image that gave no frame, in the order of the file."""
        return sorted([*self.plan.skips, *self._refused.values()], key=lambda skip: skip.index)

    @property
    def skipped(self) -> Counter[str]:
        """How much was left out, by reason: colour images, and messages of any used type that cannot be read."""
        return Counter(skip.reason for skip in self.skips) + self.plan.unreadable

    @property
    def damage(self) -> str | None:
        """What is wrong with the file after the last frame, None where it was read to its end."""
        return self._log.damage

    def storey_maps(self) -> tuple[list[StoreyMap], list[str]]:
        """The navigation maps, and why others cannot be used."""
        maps, unusable = [], []
        for message in self.plan.maps:
            try:
                maps.append(StoreyMap(self.recording, grid_of(message), float(message.info.origin.position.z) + 0.0))
            except WireError as error:
                unusable.append(str(error))
        return maps, unusable

    def __iter__(self) -> Iterator[RgbdFrame]:
        return self.frames()

    def frames(self, without: Collection[int] = ()) -> Iterator[RgbdFrame]:
        """The frames whose stamp_ns is not in `without`: what was mapped before is not decoded again."""
        topics, recording = self.plan.topics, self.recording
        planned = [p for p in self.plan.frames if p.stamp_ns not in without]
        due = {(str(topics.color), p.stamp_ns): p for p in planned}
        due |= {(str(topics.depth), p.depth_stamp_ns): p for p in planned}
        waiting: dict[int, Message] = {}  # by index: the picture of a pair that came first
        for message in self._log.messages({str(topics.color), str(topics.depth)}):
            try:
                image = decode(message.payload, message.type_name)
            except WireError:
                continue  # counted while planning: such a message has no stamp to belong to a frame
            p = due.pop((message.topic, stamp_to_ns(image.header.stamp)), None)
            if p is None:
                continue
            if p.index not in waiting:
                waiting[p.index] = image
                continue
            pair = waiting.pop(p.index), image
            try:
                yield _frame(p, *(pair if message.topic == topics.depth else pair[::-1]), recording)
            except SkipFrame as skip:
                self._refused[p.index] = Skip(p.index, p.stamp_ns, skip.reason, skip.detail)


def recording_id(path: str | os.PathLike[str]) -> str:
    """The file's stem and a short hash of its size, first and last MiB: the same wherever the file lies."""
    file_path = Path(path)
    size = file_path.stat().st_size
    digest = hashlib.sha256(str(size).encode())
    with file_path.open("rb") as file:
        digest.update(file.read(ID_WINDOW_BYTES))
        file.seek(max(size - ID_WINDOW_BYTES, 0))
        digest.update(file.read(ID_WINDOW_BYTES))
    return f"{file_path.stem}-{digest.hexdigest()[:8]}"


def _frame(planned: PlannedFrame, color: Message, depth: Message, recording: str) -> RgbdFrame:
    """Decode one pair; raises SkipFrame."""
    try:
        pixels, depth_m = color_image(color), depth_image(depth)
    except ImageRefused as refused:
        raise SkipFrame(refused.reason, str(refused)) from refused
    camera = planned.intrinsics
    sizes = {pixels.shape[:2], depth_m.shape, (camera.height, camera.width)}
    if len(sizes) > 1:
        shapes = f"colour {pixels.shape[:2]}, depth {depth_m.shape}, camera info {(camera.height, camera.width)}"
        raise SkipFrame("sizes differ", f"Height and width differ: {shapes}.")
    return RgbdFrame(planned.index, planned.stamp_ns, pixels, depth_m, camera, planned.T_map_camera, recording)
