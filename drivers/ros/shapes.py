"""Detection of the robot's ROS distribution by which message definitions decode.

Humble, Jazzy and Lyrical differ in the shape of some replies, samples and one request; Kilted is Jazzy on the wire.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any

from drivers.ros.messages import Codec, Message, WireError, codec

logger = logging.getLogger(__name__)
AUTO = "auto"
ORDER = ("jazzy", "humble", "lyrical")  # where more than one decodes, the first of them; Jazzy stands for Kilted too


class Shapes:
    """A codec that narrows down the distributions it may be talking to, with every payload that it decodes.

    A payload that none of those left can read, and another can, starts over with the others: the robot was replaced or
    upgraded, and a wrong conclusion never sticks. Thread-safe.
    """

    def __init__(self, candidates: tuple[Codec, ...]) -> None:
        self._all = self._left = candidates
        self._lock = threading.Lock()

    @property
    def distributions(self) -> tuple[str, ...]:
        """Those that agree with all that was heard; one message of each kind tells Humble, Jazzy and Lyrical apart."""
        return tuple(shapes.distribution for shapes in self._left)

    def warm_up(self, type_names: list[str]) -> None:
        """`Codec.warm_up` of every candidate."""
        for shapes in self._all:
            shapes.warm_up(type_names)

    def decode(self, payload: bytes, type_name: str) -> Message:
        """The message, in the first shape left that fits; raises WireError where it fits none of any distribution."""
        with self._lock:
            left = self._left
            fits = _decoded(left, payload, type_name) or _decoded(self._all, payload, type_name)
            if not fits:
                return left[0].decode(payload, type_name)  # raises, with the reason
            self._left = tuple(fits)
        if self._left != left:
            logger.info("Nav2's messages have the shapes of %s", " or ".join(self.distributions))
        return next(iter(fits.values()))

    def make(self, type_name: str, **fields: Any) -> Message:
        """A message that has the same shape in every distribution."""
        return self._left[0].make(type_name, **fields)

    def encode(self, message: Message) -> bytes:
        """The bytes of such a message."""
        return self._left[0].encode(message)

    def encodings(self, build: Callable[[Codec], Message]) -> dict[bytes, tuple[Codec, ...]]:
        """The different bytes that a message built in each shape left has, in order, and the shapes that have them."""
        bytes_of: dict[bytes, tuple[Codec, ...]] = {}
        for shapes in self._left:
            payload = shapes.encode(build(shapes))
            bytes_of[payload] = (*bytes_of.get(payload, ()), shapes)
        return bytes_of

    def keep(self, understood: tuple[Codec, ...]) -> None:
        """The peer took a request in these shapes."""
        with self._lock:
            self._left = tuple(shapes for shapes in self._left if shapes in understood) or understood


def shapes_of(distribution: str = AUTO) -> Shapes:
    """The shapes of one distribution, or of whichever it turns out to be; the first call takes up to 0.7 s."""
    return Shapes(tuple(codec(name) for name in (ORDER if distribution == AUTO else (distribution,))))


def _decoded(candidates: tuple[Codec, ...], payload: bytes, type_name: str) -> dict[Codec, Message]:
    fits = {}
    for shapes in candidates:
        try:
            fits[shapes] = shapes.decode(payload, type_name)
        except WireError:
            continue
    return fits
