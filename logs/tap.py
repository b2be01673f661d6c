"""The robot's topics into a recording, as they come over the wire."""

from __future__ import annotations

from collections.abc import Callable

from drivers.bridge_keys import BridgeKeys
from drivers.intake import Intake
from drivers.ports import Clock
from drivers.ros_convert import jpeg_message
from drivers.ros_images import color_image
from drivers.ros_messages import Message, codec, encode, stamp_to_ns
from drivers.topics import CAMERA_INFO, COLOR, COLOR_JPEG, DEPTH, LIDAR, MAP, TF, TF_STATIC, Topic
from drivers.zenoh_link import ZenohLink
from logs.recorder import McapRecorder

AS_THEY_ARE = (DEPTH, CAMERA_INFO, LIDAR, TF, TF_STATIC, MAP)


class TopicTap:
    """Every sensor topic is kept byte for byte, except raw colour: as JPEG it takes a tenth of the room."""

    def __init__(self, link: ZenohLink, clock: Clock, recorder: McapRecorder, keys: BridgeKeys | None = None) -> None:
        self._link, self._clock, self._recorder, self._keys = link, clock, recorder, keys or BridgeKeys()
        self.written: dict[str, int] = {}

    def start(self) -> None:
        """Begin to listen; it ends with the link."""
        for topic in AS_THEY_ARE:
            self._link.subscribe(self._keys.topic(topic), self._keeper(topic), history=topic.latched)
        raw_color = Intake(COLOR.name, COLOR.type_name, COLOR.max_bytes, codec(), self._keep_color)
        self._link.subscribe(self._keys.topic(COLOR), raw_color)

    def _keeper(self, topic: Topic) -> Callable[[bytes], None]:
        def keep(payload: bytes) -> None:
            if len(payload) <= topic.max_bytes:
                self._write(topic, self._clock.now_ns(), payload)

        return keep

    def _keep_color(self, message: Message) -> None:
        stamp_ns = stamp_to_ns(message.header.stamp)
        jpeg = jpeg_message(stamp_ns, message.header.frame_id, color_image(message))
        self._write(COLOR_JPEG, stamp_ns, encode(jpeg))

    def _write(self, topic: Topic, stamp_ns: int, payload: bytes) -> None:
        self._recorder.write_cdr(topic.name, topic.type_name, stamp_ns, payload)
        self.written[topic.name] = self.written.get(topic.name, 0) + 1
