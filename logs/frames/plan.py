"""Which frames a recording holds: topics found by type, images paired by stamp, poses looked up; the rest is counted.

Nothing here decodes a picture, so a whole recording is planned in seconds and progress has a total.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from rosbags.serde import SerdeError

from drivers.ports import PoseUnavailable
from drivers.ros.convert import transforms_of
from drivers.ros.images import COMPRESSED_IMAGE, IMAGE, ImageRefused, intrinsics, is_depth
from drivers.ros.messages import Message, WireError, codec, decode, stamp_to_ns
from drivers.ros.transform_tree import (
    TransformInvalid,
    TransformMissing,
    TransformNotYet,
    TransformStale,
    TransformTooOld,
    TransformTree,
)
from logs.mcap_io.reader import LogMessage, LogReader
from openbelief.arrays import Array
from openbelief.observation import Intrinsics

CAMERA_INFO, TF = "sensor_msgs/msg/CameraInfo", "tf2_msgs/msg/TFMessage"
GRID, MAP_TOPIC = "nav_msgs/msg/OccupancyGrid", "/map"
TRANSFORM_REASONS: dict[type[PoseUnavailable], str] = {
    TransformMissing: "no transform to the map",
    TransformNotYet: "no transform at its stamp",
    TransformTooOld: "no transform at its stamp",
    TransformStale: "stale transform",
    TransformInvalid: "invalid transform",
}
PREFERRED_COLOR = ("color", "rgb")
PREFERRED_DEPTH = ("aligned", "registered", "depth")


class RecordingError(ValueError):
    """The recording as a whole cannot give frames; one line with the cause and the remedy."""


@dataclass(frozen=True)
class RecordingTopics:
    """Which topics to read; None finds the only one of its kind."""

    color: str | None = None
    depth: str | None = None
    camera_info: str | None = None


@dataclass(frozen=True)
class PlanOptions:
    """How to read: as `logs.frames.reader.FrameReader` says."""

    topics: RecordingTopics
    map_frame: str
    stride: int
    pair_tolerance_s: float


@dataclass(frozen=True)
class Skip:
    """A colour image that gives no frame. reason: the same for all of its kind; detail: this one's."""

    index: int
    stamp_ns: int
    reason: str
    detail: str


@dataclass(frozen=True)
class PlannedFrame:
    """A frame whose pictures are still to be decoded. index: the colour image's rank in the recording."""

    index: int
    stamp_ns: int
    depth_stamp_ns: int
    intrinsics: Intrinsics
    T_map_camera: Array


@dataclass
class Scan:
    """What one pass over a recording found, by topic; heads are (stamp_ns, frame_id) in the order of the file.

    maps: the newest navigation map of each height (z of its origin, decimetres).
    """

    color: dict[str, list[tuple[int, str]]] = field(default_factory=lambda: defaultdict(list))
    depth: dict[str, list[tuple[int, str]]] = field(default_factory=lambda: defaultdict(list))
    infos: dict[str, dict[int, Message]] = field(default_factory=lambda: defaultdict(dict))
    tree: TransformTree = field(default_factory=TransformTree)
    unreadable: Counter[str] = field(default_factory=Counter)
    maps: dict[int, Message] = field(default_factory=dict)


@dataclass(frozen=True)
class FramePlan:
    """topics: as chosen. frames and skips: in the order of the file. unreadable: messages that are not their type.

    maps: the navigation maps, the newest of each height.
    """

    topics: RecordingTopics
    frames: list[PlannedFrame]
    skips: list[Skip]
    unreadable: Counter[str]
    maps: list[Message]


class SkipFrame(Exception):
    """This frame is not used; `reason` and `detail` say why."""

    def __init__(self, reason: str, detail: str) -> None:
        super().__init__(detail)
        self.reason, self.detail = reason, detail


def scan(reader: LogReader, max_tf_gap_s: float) -> Scan:
    """One pass over the recording: transforms, calibrations and the stamps of all pictures."""
    found = Scan(tree=TransformTree(max_gap_s=max_tf_gap_s))
    handlers = {IMAGE: _add_image, COMPRESSED_IMAGE: _add_image, CAMERA_INFO: _add_info, TF: _add_transforms}
    handlers[GRID] = _add_map
    for message in reader:
        if message.type_name in handlers and message.encoding == "cdr":
            try:
                handlers[message.type_name](found, message)
            except WireError:
                found.unreadable[f"unreadable {message.type_name}"] += 1
    return found


def plan_frames(found: Scan, options: PlanOptions, name: str) -> FramePlan:
    """Pair and pose every stride-th colour image; raises RecordingError where a kind of topic is missing or unclear."""
    chosen = choose_topics(found, options.topics, name)
    pairing = _Pairing(found, chosen, options)
    frames: list[PlannedFrame] = []
    skips: list[Skip] = []
    seen: set[int] = set()
    for index, (stamp_ns, frame_id) in enumerate(found.color[str(chosen.color)]):
        if index % options.stride:
            continue
        try:
            if stamp_ns in seen:
                raise SkipFrame("repeated stamp", f"A colour image of stamp {stamp_ns} came before.")
            seen.add(stamp_ns)
            frames.append(pairing.frame(index, stamp_ns, frame_id))
        except SkipFrame as skip:
            skips.append(Skip(index, stamp_ns, skip.reason, skip.detail))
    return FramePlan(chosen, frames, skips, found.unreadable, [found.maps[z] for z in sorted(found.maps)])


def choose_topics(found: Scan, topics: RecordingTopics, name: str) -> RecordingTopics:
    """The named topics, else the only ones that can be meant; raises RecordingError."""
    color = _choose("colour", found.color, topics.color, PREFERRED_COLOR, name, "--color-topic")
    depth = _choose("depth", found.depth, topics.depth, PREFERRED_DEPTH, name, "--depth-topic")
    beside = _base(color).rpartition("/")[0] + "/camera_info"
    frame_id = found.color[color][0][1]
    of_camera = [t for t, infos in found.infos.items() if next(iter(infos.values())).header.frame_id == frame_id]
    likely = [beside] if beside in found.infos else of_camera
    candidates = found.infos if topics.camera_info else likely
    info = _choose("camera info", candidates, topics.camera_info, (), name, "--camera-info-topic")
    return RecordingTopics(color, depth, info)


def _choose(
    what: str, candidates: Collection[str], named: str | None, preferred: tuple[str, ...], name: str, option: str
) -> str:
    if named is not None:
        if named not in candidates:
            known = ", ".join(sorted(candidates)) or "none"
            raise RecordingError(f"{name} has no {what} topic {named!r}; it has: {known}.")
        return named
    if not candidates:
        raise RecordingError(f"{name} holds no {what} topic, so no frame can be made of it; record it as well.")
    raw = sorted(t for t in candidates if _base(t) == t or _base(t) not in candidates)  # raw before its compressed twin
    for word in ("", *preferred):
        if len(left := [t for t in raw if word in t]) == 1:
            return left[0]
    raise RecordingError(f"{name} holds several {what} topics ({', '.join(raw)}): name one with {option}.")


def _base(topic: str) -> str:
    """The image topic behind a transport's: /a/image/compressed -> /a/image."""
    return topic.removesuffix("/compressedDepth").removesuffix("/compressed")


class _Pairing:
    """Finds what belongs to a colour image, or raises SkipFrame."""

    def __init__(self, found: Scan, topics: RecordingTopics, options: PlanOptions) -> None:
        self._tree, self._map_frame = found.tree, options.map_frame
        self._tolerance_ns = round(options.pair_tolerance_s * 1e9)
        self._infos = found.infos[str(topics.camera_info)]
        self._depth_frames = dict(found.depth[str(topics.depth)])
        self._depth_stamps, self._info_stamps = sorted(self._depth_frames), sorted(self._infos)

    def frame(self, index: int, stamp_ns: int, frame_id: str) -> PlannedFrame:
        depth_ns = self._nearest(self._depth_stamps, stamp_ns, "depth image")
        info_ns = self._nearest(self._info_stamps, stamp_ns, "camera info")
        self._require_aligned(stamp_ns, frame_id, self._depth_frames[depth_ns])
        try:
            camera = intrinsics(self._infos[info_ns])
        except ImageRefused as refused:
            raise SkipFrame(refused.reason, str(refused)) from refused
        return PlannedFrame(index, stamp_ns, depth_ns, camera, self._pose(stamp_ns, self._map_frame, frame_id))

    def _nearest(self, stamps: list[int], stamp_ns: int, what: str) -> int:
        i = bisect_left(stamps, stamp_ns)
        nearest = min(stamps[max(i - 1, 0) : i + 1], key=lambda s: abs(s - stamp_ns), default=None)
        if nearest is None or abs(nearest - stamp_ns) > self._tolerance_ns:
            raise SkipFrame(
                f"no {what} at its stamp", f"No {what} within {self._tolerance_ns / 1e6:g} ms of {stamp_ns}."
            )
        return nearest

    def _require_aligned(self, stamp_ns: int, color_frame: str, depth_frame: str) -> None:
        """Depth in another frame than colour is used only where /tf says that the two are one."""
        if depth_frame != color_frame and not np.allclose(self._pose(stamp_ns, color_frame, depth_frame), np.eye(4)):
            raise SkipFrame(
                "depth not aligned to colour",
                f"Depth is in {depth_frame!r}, colour in {color_frame!r}: record the depth aligned to colour.",
            )

    def _pose(self, stamp_ns: int, target: str, source: str) -> Array:
        try:
            return self._tree.lookup(stamp_ns, target, source)
        except PoseUnavailable as error:
            raise SkipFrame(TRANSFORM_REASONS[type(error)], str(error)) from error


def _add_image(found: Scan, message: LogMessage) -> None:
    image = decode(message.payload, message.type_name)
    kind = found.depth if is_depth(image) else found.color
    kind[message.topic].append((stamp_to_ns(image.header.stamp), image.header.frame_id))


def _add_info(found: Scan, message: LogMessage) -> None:
    info = decode(message.payload, message.type_name)
    found.infos[message.topic].setdefault(stamp_to_ns(info.header.stamp), info)


def _add_map(found: Scan, message: LogMessage) -> None:
    if message.topic == MAP_TOPIC:
        grid = decode(message.payload, message.type_name)
        found.maps[round(10 * grid.info.origin.position.z)] = grid


def _add_transforms(found: Scan, message: LogMessage) -> None:
    static = message.topic.endswith("tf_static")
    for t in transforms_of(_decode_transforms(message.payload)):
        found.tree.add(**vars(t), static=static)


def _decode_transforms(payload: bytes) -> Any:
    """Not `decode`, which refuses a message for one NaN: the tree keeps what is no transform and refuses its stamps."""
    try:
        return codec().store.deserialize_cdr(memoryview(payload), TF)
    except (SerdeError, IndexError, OverflowError, MemoryError) as error:
        raise WireError(f"{len(payload)} bytes are not a {TF}: {error}") from error
