"""What can go wrong at the robot's end, on demand. Everything is off until a test or an operator's drill sets it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from drivers.ros.messages import decode, encode, ns_to_stamp, stamp_to_ns
from drivers.topics import TRANSFORMS, Topic

ALWAYS = 1 << 30
GARBAGE = b"\x00\x01\x00\x00 this is no message"


@dataclass
class Nav2Faults:
    """Faults of the simulated Nav2. The counters are by part: send_goal, get_result, cancel_goal, is_active, plan.

    lost[part]: the next so many questions are acted on and never answered. empty[part]: acted on, ended without a
    reply. garbage[part]: answered with bytes that are no message.
    """

    reject: bool = False  # goals
    inactive: bool = False  # is_active says false
    abort: tuple[int, str] | None = None  # the goal under way ends with this code and message
    cancel_code: int | None = None  # cancel answers this and does nothing
    stuck: bool = False  # goals are accepted and never end
    silent: bool = False  # no feedback, no status
    slow_s: float = 0.0  # wall time before each answer
    lost: Counter[str] = field(default_factory=Counter)
    empty: Counter[str] = field(default_factory=Counter)
    garbage: Counter[str] = field(default_factory=Counter)

    def take(self, counter: Counter[str], part: str) -> bool:
        """Whether this question is one of the faulty ones."""
        if counter[part] <= 0:
            return False
        counter[part] -= 1
        return True


@dataclass
class SensorFaults:
    """Faults of the simulated sensors, by ROS name. frozen_ns: stamps stand still there. muted: nothing is sent.
    spoiled: payloads are sent through this function."""

    frozen_ns: int | None = None
    muted: set[str] = field(default_factory=set)
    spoiled: dict[str, Callable[[bytes], bytes]] = field(default_factory=dict)


def garbage(_payload: bytes) -> bytes:
    """Bytes that are no message."""
    return GARBAGE


def truncated(payload: bytes) -> bytes:
    """The first half of a message."""
    return payload[: len(payload) // 2]


def oversize(payload: bytes) -> bytes:
    """A message with 9 MiB of nothing behind it."""
    return payload + bytes(9 << 20)


def not_finite(payload: bytes) -> bytes:
    """A message whose last eight bytes are the double NaN: the w of a last transform."""
    return payload[:-8] + np.float64(np.nan).tobytes()


def shifted(topic: Topic, by_s: float) -> Callable[[bytes], bytes]:
    """Every stamp of a message later by so much: the robot's clock was set."""
    by_ns = round(by_s * 1e9)

    def spoil(payload: bytes) -> bytes:
        message = decode(payload, topic.type_name)
        for stamped in message.transforms if topic.type_name == TRANSFORMS else [message]:
            stamped.header.stamp = ns_to_stamp(stamp_to_ns(stamped.header.stamp) + by_ns)
        return encode(message)

    return spoil
