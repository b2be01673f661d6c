"""Which topics of a recording are meant: by name and role; where it is unclear, a refusal with all that could be."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from logs.frames.reasons import RecordingError

PREFERRED_COLOR = ("color", "rgb")
PREFERRED_DEPTH = ("aligned", "registered", "depth")
# Encodings and types of messages that are not read -> the way out
UNREAD_ENCODINGS = {
    "protobuf": "record ROS 2 messages (ros2 bag record)",
    "flatbuffer": "record ROS 2 messages (ros2 bag record)",
    "json": "record ROS 2 messages (ros2 bag record)",
    "ros1": "only ROS 1 types that ROS 2 has, too, are read",
    "zstd": "its message compression does not expand: record without it",
}
VIDEO = "video has no frames of their own: republish it as raw or JPEG images (image_transport republish)"
XFER_FORMAT = "set xfer_format = 0 in the livox driver's launch file: it sends PointCloud2 then"
UNREAD_TYPES = {
    "foxglove_msgs/msg/CompressedVideo": VIDEO,
    "ffmpeg_image_transport_msgs/msg/FFMPEGPacket": VIDEO,
    "theora_image_transport/msg/Packet": VIDEO,
    "livox_ros_driver2/msg/CustomMsg": XFER_FORMAT,
    "livox_ros_driver/msg/CustomMsg": XFER_FORMAT,
}
SHOWN = 6


@dataclass(frozen=True)
class RecordingTopics:
    """Which topics to read; None finds the only one of its kind."""

    color: str | None = None
    depth: str | None = None
    camera_info: str | None = None


def choose(
    what: str, candidates: Collection[str], named: str | None, preferred: tuple[str, ...], name: str, option: str
) -> str:
    """The named topic, else the only one that can be meant. Raises RecordingError."""
    if named is not None:
        if named not in candidates:
            raise RecordingError(f"{name} has no {what} topic {named!r}; it has: {listed(candidates)}.")
        return named
    raw = sorted(t for t in candidates if base(t) == t or base(t) not in candidates)  # raw before its compressed twin
    for word in ("", *preferred):
        if len(left := [t for t in raw if word in t]) == 1:
            return left[0]
    raise RecordingError(f"{name} holds several {what} topics ({', '.join(raw)}): name one with {option}.")


def base(topic: str) -> str:
    """The image topic behind a transport's: /a/image/compressed -> /a/image."""
    return topic.removesuffix("/compressedDepth").removesuffix("/compressed")


def is_called_depth(topic: str) -> bool:
    """Whether a topic's own name, not its camera's, says depth: /camera/aligned_depth_to_color/image_raw."""
    return any("depth" in word for word in base(topic).lower().split("/")[-2:])


def listed(topics: Collection[str]) -> str:
    return ", ".join(sorted(topics)) or "none"


def is_read(encoding: str, type_name: str) -> bool:
    return encoding == "cdr" and type_name not in UNREAD_TYPES


def unread(foreign: Mapping[str, tuple[str, str]]) -> str:
    """What lies in topics that are not read, and what to do: a sentence, empty where there is none.

    foreign: topic -> (type, encoding).
    """
    words = []
    for topic, (type_name, encoding) in sorted(foreign.items())[:SHOWN]:
        remedy = UNREAD_TYPES.get(type_name) or UNREAD_ENCODINGS.get(encoding, "ROS 2 messages (CDR) are read")
        form = "" if encoding == "cdr" else f" as {encoding}"
        words.append(f"{topic} is {type_name or 'of no type'}{form}: {remedy}")
    more = f" (and {len(foreign) - SHOWN} more)" if len(foreign) > SHOWN else ""
    return f" Not read: {'; '.join(words)}{more}." if words else ""
