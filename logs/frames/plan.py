"""Which frames a recording holds: topics chosen, images paired by stamp, poses looked up; the rest is counted.

Nothing here decodes a picture, so a whole recording is planned in seconds and progress has a total.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from drivers.ros.encodings import NAMELESS
from drivers.ros.messages import Message
from logs.frames.pairing import Pairing, PlannedFrame, PlanOptions
from logs.frames.reasons import FrameReason, RecordingError, Skip, SkipFrame
from logs.frames.scan import ImageHead, Scan
from logs.frames.topics import (
    PREFERRED_COLOR,
    PREFERRED_DEPTH,
    SHOWN,
    RecordingTopics,
    base,
    choose,
    is_called_depth,
    unread,
)


@dataclass(frozen=True)
class RecordingFile:
    """What is said of a recording in a refusal. number: of the file among those that were scanned together."""

    name: str
    kind: str = "MCAP"
    damage: str | None = None
    number: int = 0

    def __str__(self) -> str:
        return self.name if self.kind == "MCAP" else f"{self.name} ({self.kind})"


@dataclass(frozen=True)
class FramePlan:
    """topics: as chosen. frames and skips: in the order of the file. unreadable: messages that are not their type.

    maps: the navigation maps, the newest of each height. notes: what a person should know although it can be used.
    """

    topics: RecordingTopics
    frames: list[PlannedFrame]
    skips: list[Skip]
    unreadable: Counter[str]
    maps: list[Message]
    notes: list[str]


def plan_frames(found: Scan, own: Scan, options: PlanOptions, file: RecordingFile) -> FramePlan:
    """Pair and pose every stride-th colour image; raises RecordingError where a kind of topic is missing or unclear.

    found: the file's own scan, or that of all files of a split recording.
    """
    chosen = choose_topics(found, options.topics, file)
    pairing = Pairing(found, chosen, options)
    frames: list[PlannedFrame] = []
    skips: list[Skip] = []
    seen: set[int] = set()
    heads = [head for head in found.images[str(chosen.color)] if head.file == file.number]
    for index, head in enumerate(heads):
        stamp_ns = head.mark.stamp_ns
        if index % options.stride:
            continue
        try:
            if stamp_ns in seen:
                raise SkipFrame(FrameReason.REPEATED, f"A colour image of stamp {stamp_ns} came before.")
            seen.add(stamp_ns)
            frames.append(pairing.frame(index, head))
        except SkipFrame as skip:
            skips.append(Skip(index, stamp_ns, skip.reason, skip.detail))
    notes = found.notes + _nameless(found, chosen)
    return FramePlan(chosen, frames, skips, own.unreadable, [own.maps[z] for z in sorted(own.maps)], notes)


def choose_topics(found: Scan, topics: RecordingTopics, file: RecordingFile) -> RecordingTopics:
    """The named topics, else the only ones that can be meant; raises RecordingError."""
    called_depth = {topic: heads for topic, heads in found.color.items() if is_called_depth(topic)}
    colors = {
        t: heads for t, heads in found.color.items() if t != topics.depth and t not in called_depth
    } or found.color
    color = _image_topic("colour", found, colors, topics.color, PREFERRED_COLOR, file, "--color-topic")
    # Depth in an encoding that nobody knows is still the depth topic: decoding names the encoding
    others = {topic: heads for topic, heads in (found.depth or called_depth).items() if topic != color}
    depth = _image_topic("depth", found, others, topics.depth, PREFERRED_DEPTH, file, "--depth-topic")
    beside = base(color).rpartition("/")[0] + "/camera_info"
    frame_id = found.images[color][0].frame_id
    of_camera = [topic for topic, infos in found.infos.items() if infos[0][1].header.frame_id == frame_id]
    likely = [beside] if beside in found.infos else of_camera or list(found.infos)[:1] * (len(found.infos) == 1)
    candidates = found.infos if topics.camera_info else likely
    if not candidates:
        known = f" (of other cameras: {', '.join(sorted(found.infos))})" if found.infos else ""
        raise RecordingError(_missing("camera info", file, found) + known)
    info = choose("camera info", candidates, topics.camera_info, (), str(file), "--camera-info-topic")
    return RecordingTopics(color, depth, info)


def _image_topic(
    what: str,
    found: Scan,
    candidates: dict[str, list[ImageHead]],
    named: str | None,
    preferred: tuple[str, ...],
    file: RecordingFile,
    option: str,
) -> str:
    """A topic that was named may be any of images; decoding tells whether it is what it was named for."""
    if not candidates and not (named and named in found.images):
        raise RecordingError(_missing(what, file, found))
    return choose(what, found.images if named else candidates, named, preferred, str(file), option)


def _missing(what: str, file: RecordingFile, found: Scan) -> str:
    """Why there is none: damage, messages that cannot be read, or nothing of the kind."""
    bad = ", ".join(f"{count} x {name}" for name, count in found.unreadable.most_common())
    words = f" It has {bad}." if bad else ""
    if file.damage:
        first = what if what == "camera info" else f"{what} image"
        limit = "limit" in file.damage  # whole, but more than is read: recover would leave it out, too
        rescue = f" Keep what it still holds with: openbelief recover {file.name}" if file.kind == "MCAP" else ""
        state = "cannot be read up to" if limit else "is damaged before"
        return f"{file} {state} its first {first}: {file.damage}.{words}{'' if limit else rescue}"
    pictures = ", ".join(f"{t} ({'/'.join(sorted(found.encodings[t]))})" for t in sorted(found.images))
    held = ", ".join(f"{topic} ({kind})" for topic, kind in sorted(found.types.items())[:SHOWN])
    others = f" Images in it: {pictures}." if pictures and what != "camera info" else f" It holds: {held or 'nothing'}."
    return (
        f"{file} holds no {what} topic, so no frame can be made of it; record it as well."
        f"{others}{words}{unread(found.foreign)}"
    )


def _nameless(found: Scan, topics: RecordingTopics) -> list[str]:
    names = sorted(found.encodings[str(topics.color)] & set(NAMELESS))
    return [f"{topics.color} is {name}, which names no channels: read as cv_bridge does, in BGR" for name in names]
