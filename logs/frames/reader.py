"""A recording as posed RGB-D frames: what is missing, stale or unreadable is skipped and counted."""

from __future__ import annotations

import os
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from drivers.ros.convert import grid_of
from drivers.ros.images import COMPRESSED_IMAGE, IMAGE
from drivers.ros.messages import Message, WireError, decode
from logs.containers.folder import split_sets
from logs.containers.recording import Recording, recording_id
from logs.frames.decoding import FrameDecoder
from logs.frames.pairing import PlannedFrame, PlanOptions
from logs.frames.plan import FramePlan, RecordingFile, plan_frames
from logs.frames.reasons import FrameReason, RecordingError, Skip, SkipFrame, explained
from logs.frames.scan import Scan
from logs.frames.split import SplitRecording, Stretch
from logs.frames.topics import RecordingTopics
from openbelief.observation import RgbdFrame
from openbelief.surroundings import StoreyMap

__all__ = ["FrameReader", "ReadOptions", "RecordingError", "RecordingTopics", "frame_readers", "recording_id"]

MAX_TF_GAP_S, PAIR_TOLERANCE_S = 0.25, 0.005
SPECIAL = ("max_tf_gap_s", "pair_tolerance_s", "depth_offset_s", "depth_is_aligned")


@dataclass(frozen=True, kw_only=True)
class ReadOptions:
    """How recordings are read.

    max_tf_gap_s: the longest time between two transforms that may be interpolated. pair_tolerance_s: how far a depth
    image's stamp may be from the colour's, once the depth camera's clock is set back by depth_offset_s.
    depth_is_aligned: to colour, whatever its frame_id says.
    """

    topics: RecordingTopics = field(default_factory=RecordingTopics)
    map_frame: str = "map"
    stride: int = 1
    max_tf_gap_s: float = MAX_TF_GAP_S
    pair_tolerance_s: float = PAIR_TOLERANCE_S
    depth_offset_s: float = 0.0
    depth_is_aligned: bool = False

    def about(self) -> dict[str, Any]:
        """What a memory keeps of it: stride and map frame, and whatever is not as usual."""
        usual = ReadOptions()
        more = {name: getattr(self, name) for name in SPECIAL if getattr(self, name) != getattr(usual, name)}
        return {"stride": self.stride, "map_frame": self.map_frame, **more}


class FrameReader:
    """Iterate to get the frames, in the order of the file; afterwards `skips` says what was left out.

    path: any recording that `Recording` reads; options: those of `ReadOptions`. The header's stamp counts, never the
    time of logging. A truncated or damaged file gives what lies before the damage, and `damage` says so. Raises
    LogError where the file is no recording, RecordingError where a kind of topic is missing or unclear.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        topics: RecordingTopics | None = None,
        map_frame: str = "map",
        stride: int = 1,
        max_tf_gap_s: float = MAX_TF_GAP_S,
        pair_tolerance_s: float = PAIR_TOLERANCE_S,
        depth_offset_s: float = 0.0,
        depth_is_aligned: bool = False,
    ) -> None:
        self._options = PlanOptions(
            topics or RecordingTopics(), map_frame, stride, pair_tolerance_s, depth_offset_s, depth_is_aligned
        )
        self._part_of(SplitRecording([Recording(path)], max_tf_gap_s), 0)
        self._refused: dict[int, Skip] = {}  # by index: what only decoding found
        self._decoder = FrameDecoder()

    def _part_of(self, split: SplitRecording, number: int) -> None:
        self._split, self._number = split, number
        self._log = split.logs[number]
        self.path = self._log.path

    @cached_property
    def recording(self) -> str:
        """The recording's id: `recording_id`."""
        return recording_id(self.path)

    @property
    def scan(self) -> Scan:
        """What one pass over this file found."""
        return self._split.scans[self._number]

    @cached_property
    def _stretch(self) -> tuple[Stretch, int]:
        return self._split.stretch_of(self._number)

    @cached_property
    def plan(self) -> FramePlan:
        """Frames to come and images skipped so far; the first use reads through the file."""
        stretch, number = self._stretch
        file = RecordingFile(self.path.name, self._log.kind, self.damage, number)
        return plan_frames(stretch.found, self.scan, self._options, file)

    @property
    def skips(self) -> list[Skip]:
        """Every colour image that gave no frame, in the order of the file."""
        return sorted([*self.plan.skips, *self._refused.values()], key=lambda skip: skip.index)

    @property
    def skipped(self) -> Counter[str]:
        """How much was left out, by reason: colour images, and messages of any used type that cannot be read."""
        return Counter(str(skip.reason) for skip in self.skips) + self.plan.unreadable

    @property
    def notes(self) -> list[str]:
        """What a person should know although frames can be made."""
        return [*self.plan.notes, *sorted(self._decoder.scaled)]

    @property
    def damage(self) -> str | None:
        """What is wrong with the file after the last frame, None where it was read to its end."""
        return self._log.damage

    @property
    def gave_nothing(self) -> bool:
        """Whether no planned frame could be decoded."""
        return len(self._refused) == len(self.plan.frames)

    def why_nothing(self) -> str:
        """Why it gives no frame, with what to do: after planning, or after the frames were read."""
        unreadable = "; ".join(f"{count} x {name}" for name, count in self.plan.unreadable.most_common())
        ends = f"it cannot be read to its end: {self.damage}" if self.damage else ""
        return "; ".join(filter(None, (explained(self.skips), unreadable, ends))) or "it holds no colour image"

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
        topics = self.plan.topics
        planned = [p for p in self.plan.frames if p.stamp_ns not in without]
        color, depth = (str(topics.color), str(topics.depth))
        due: dict[tuple[str, int], list[PlannedFrame]] = defaultdict(list)
        for p in planned:
            due[color, p.color.rank].append(p)
            if p.depth.file == p.color.file:
                due[depth, p.depth.rank].append(p)
        waiting = self._borrowed(depth, planned)  # by index: the picture of a pair that came first
        missing = {p.index: p for p in planned}
        for topic, rank, message in _images(self._log, {color, depth}):
            wanted = due.pop((topic, rank), ())
            image = _decoded(message.payload, message.type_name) if wanted else None
            for p in wanted:
                if image is None:
                    continue
                if p.index not in waiting:
                    waiting[p.index] = image
                    continue
                first = waiting.pop(p.index)
                del missing[p.index]
                pair = (first, image) if topic == depth else (image, first)
                try:
                    yield self._decoder.frame(p, *pair, self.recording)
                except SkipFrame as skip:
                    self._refused[p.index] = Skip(p.index, p.stamp_ns, skip.reason, skip.detail)
        for p in missing.values():
            detail = "One of its two pictures was there while the recording was planned, and is not any more."
            self._refused[p.index] = Skip(p.index, p.stamp_ns, FrameReason.NO_PARTNER, detail)

    def _borrowed(self, topic: str, planned: Sequence[PlannedFrame]) -> dict[int, Message]:
        """Depth images of other files of the split recording, by the index of the frames that need them."""
        stretch, number = self._stretch
        needed: dict[int, dict[int, list[int]]] = defaultdict(lambda: defaultdict(list))  # file -> rank -> indices
        for p in planned:
            if p.depth.file != number:
                needed[p.depth.file][p.depth.rank].append(p.index)
        found: dict[int, Message] = {}
        for file, indices in needed.items():
            for _, rank, message in _images(stretch.logs[file], {topic}):
                image = _decoded(message.payload, message.type_name) if rank in indices else None
                if image is not None:
                    found |= dict.fromkeys(indices[rank], image)
                if rank >= max(indices):
                    break
        return found


def frame_readers(paths: Sequence[Path], options: ReadOptions) -> list[FrameReader]:
    """A reader for each recording, in the order given; numbered files of one recording share what lies at borders."""
    settings = {name: getattr(options, name) for name in options.__dataclass_fields__}
    readers = {path: FrameReader(path, **settings) for path in paths}
    for files in split_sets([path for path in readers if path.is_file()]):
        split = SplitRecording([Recording(path) for path in files], options.max_tf_gap_s)
        for number, path in enumerate(files):
            readers[path]._part_of(split, number)
    return [readers[path] for path in paths]


def _images(log: Recording, topics: Collection[str]) -> Iterator[tuple[str, int, Message]]:
    """(topic, rank among the topic's images as `scan` counts them, the message)."""
    ranks: Counter[str] = Counter()
    for message in log.messages(topics):
        if message.encoding == "cdr" and message.type_name in (IMAGE, COMPRESSED_IMAGE):
            yield message.topic, ranks[message.topic], message
            ranks[message.topic] += 1


def _decoded(payload: bytes, type_name: str) -> Message | None:
    try:
        return decode(payload, type_name)
    except WireError:
        return None
