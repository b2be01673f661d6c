"""The robot's topics into a recording, as they come over the wire."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from dataclasses import replace

from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.image_messages import jpeg_message
from drivers.ros.images import color_image
from drivers.ros.messages import WireError, decode, encode, stamp_to_ns
from drivers.ros.zenoh_link import ZenohLink
from drivers.topics import (
    CAMERA_IMU,
    CAMERA_INFO,
    COLOR,
    COLOR_JPEG,
    DEPTH,
    IMAGE,
    LIDAR,
    LIDAR_IMU,
    MAP,
    TF,
    TF_STATIC,
    TRANSFORMS,
    Topic,
)
from logs.record.queued import Cdr, QueuedRecorder

OTHERS = (DEPTH, CAMERA_INFO, LIDAR, LIDAR_IMU, CAMERA_IMU, TF, TF_STATIC, MAP)
STAMP = {0: struct.Struct(">iI"), 1: struct.Struct("<iI")}  # by the encapsulation's second byte

Maker = Callable[[Topic, bytes], Cdr]


class TopicTap:
    """Every topic is kept byte for byte, except raw colour: as JPEG it takes a tenth of the room.

    Depth needs no codec of its own: the file's chunks are zstd.
    """

    def __init__(
        self,
        link: ZenohLink,
        queue: QueuedRecorder,
        keys: BridgeKeys | None = None,
        *,
        color: Topic | None = COLOR,
        others: Iterable[Topic] = OTHERS,
    ) -> None:
        self._link, self._queue, self._keys = link, queue, keys or BridgeKeys()
        self._makers: list[tuple[Topic, Topic, Maker]] = [(topic, topic, as_it_is) for topic in others]
        if color is not None and color.type_name == IMAGE:
            self._makers.append((color, replace(COLOR_JPEG, name=f"{color.name}/compressed"), jpeg_of))
        elif color is not None:
            self._makers.append((color, color, as_it_is))

    def start(self) -> None:
        """Begin to listen; it ends with the link."""
        for topic, kept, make in self._makers:
            self._queue.stream(kept.name).lasting = not topic.latched
            self._link.subscribe(self._keys.topic(topic), self._keeper(topic, kept, make), history=topic.latched)

    def gone(self) -> str | None:
        """A sentence while the link is down; Zenoh connects again by itself."""
        return None if self._link.alive else f"The link to {', '.join(self._link.config.endpoints)} is down."

    def _keeper(self, topic: Topic, kept: Topic, make: Maker) -> Callable[[bytes], None]:
        def keep(payload: bytes) -> None:
            if len(payload) > topic.max_bytes:
                self._queue.stream(kept.name).drop(f"{len(payload)} bytes are more than the {topic.max_bytes} allowed")
                return
            self._queue.offer(kept.name, len(payload), lambda: make(kept, payload))

        return keep


def as_it_is(topic: Topic, payload: bytes) -> Cdr:
    return Cdr(topic.name, topic.type_name, header_stamp(topic, payload), payload)


def jpeg_of(topic: Topic, payload: bytes) -> Cdr:
    """Raises ImageRefused or WireError where it is no colour image."""
    image = decode(payload, IMAGE)
    stamp_ns = stamp_to_ns(image.header.stamp)
    jpeg = jpeg_message(stamp_ns, image.header.frame_id, color_image(image))
    return Cdr(topic.name, topic.type_name, stamp_ns, encode(jpeg))


def header_stamp(topic: Topic, payload: bytes) -> int:
    """The header's stamp, without decoding the rest; of a TFMessage its first transform's. Raises WireError."""
    begin = 8 if topic.type_name == TRANSFORMS else 4  # behind the encapsulation, and the sequence's length
    if len(payload) < begin + 8 or payload[1] not in STAMP:
        raise WireError(f"{len(payload)} bytes are not a {topic.type_name}")
    seconds, nanoseconds = STAMP[payload[1]].unpack_from(payload, begin)
    return int(seconds) * 10**9 + int(nanoseconds)
