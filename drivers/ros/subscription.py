"""A validated subscription to one topic: payloads too large, undecodable or not finite are counted, logged, dropped."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Protocol

from drivers.ros.bridge_keys import Keys
from drivers.ros.messages import Message, codec
from drivers.ros.zenoh_link import ZenohLink
from drivers.topics import Topic

logger = logging.getLogger(__name__)


class Decoder(Protocol):
    """A `Codec`, or `Shapes` that find out which codec it takes."""

    def decode(self, payload: bytes, type_name: str) -> Message: ...


class Subscription:
    """A subscriber's callback. `use` gets every good message; a ValueError it raises drops the message too."""

    def __init__(
        self, what: str, type_name: str, max_bytes: int, decoder: Decoder, use: Callable[[Message], None]
    ) -> None:
        self._what, self._type_name, self._max_bytes = what, type_name, max_bytes
        self._decoder, self._use = decoder, use
        self.received = 0
        self.dropped = 0
        self.reason = ""  # of the newest drop
        self.parts = 0  # of messages otherwise good
        self.part_reason = ""

    def __call__(self, payload: bytes) -> None:
        if len(payload) > self._max_bytes:
            self.drop(f"{len(payload)} bytes are more than the {self._max_bytes} allowed.")
            return
        try:
            self._use(self._decoder.decode(payload, self._type_name))
        except ValueError as error:  # WireError, ImageRefused
            self.drop(str(error))
        else:
            self.received += 1

    def drop(self, reason: str) -> None:
        """Count a message that cannot be used."""
        self.dropped, self.reason = self.dropped + 1, reason
        if self.dropped & (self.dropped - 1) == 0:  # 1, 2, 4, 8 ...: a bad publisher must not flood the log
            logger.warning("%s: %d message(s) dropped so far, the last because: %s", self._what, self.dropped, reason)

    def spoilt(self, reason: str) -> None:
        """Count a part of a message that cannot be used, while the rest is."""
        self.parts, self.part_reason = self.parts + 1, reason
        if self.parts & (self.parts - 1) == 0:
            logger.warning("%s: %d part(s) not used so far, the last: %s", self._what, self.parts, reason)

    def trouble(self) -> str:
        """A sentence on what was dropped, empty where nothing was."""
        dropped = f" {self.dropped} messages were dropped, the last because: {self.reason}" if self.dropped else ""
        return dropped + (
            f" {self.parts} parts of messages were not used, the last: {self.part_reason}" * bool(self.parts)
        )


def listen(
    link: ZenohLink, keys: Keys, topic: Topic, use: Callable[[Message], None], decoder: Decoder | None = None
) -> Subscription:
    """Subscribe to a topic; what cannot be used is dropped before the callback."""
    intake = Subscription(topic.name, topic.type_name, topic.max_bytes, decoder or codec(), use)
    link.subscribe(keys.topic(topic), intake, history=topic.latched)
    return intake
