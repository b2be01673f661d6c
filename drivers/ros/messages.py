"""ROS 2 messages as CDR bytes: one codec per ROS distribution, one exception for all that a wire can get wrong."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.base import TypesysError

from drivers.ros.definitions import definitions

Message = Any  # a dataclass that the type store generated; its type's name is `__msgtype__`
BASE = {
    "humble": Stores.ROS2_HUMBLE,
    "jazzy": Stores.ROS2_JAZZY,
    "kilted": Stores.ROS2_KILTED,
    "lyrical": Stores.ROS2_LYRICAL,
}
DISTRIBUTIONS = tuple(BASE)
ZERO = {"bool": False, "float32": 0.0, "float64": 0.0, "string": ""}
NUMPY = {"bool": "bool", "char": "uint8", "byte": "uint8"}
DEFAULTS = {"geometry_msgs/msg/Quaternion": {"w": 1.0}}  # the one type in use whose .msg file says so
NAN_IS_UNMEASURED = {"sensor_msgs/msg/BatteryState"}  # by its .msg file; the others' numbers are there or wrong
# Types of which one part may be NaN while the rest is good: who reads them checks each number that it uses.
CHECKED_BY_THE_READER = {
    "sensor_msgs/msg/CameraInfo",  # P, R or D of drivers that fill in only K
    "sensor_msgs/msg/Imu",  # orientations that nobody estimates
    "tf2_msgs/msg/TFMessage",  # one wheel without an encoder beside the robot's pose
}


class WireError(ValueError):
    """A payload is not the message it should be; the text names the type and what is wrong with it."""


@dataclass(frozen=True)
class Codec:
    """Bytes to messages and back, in the shapes of one ROS distribution."""

    distribution: str
    store: Any

    def encode(self, message: Message) -> bytes:
        """CDR little endian, with its 4-byte encapsulation; raises WireError where a field does not fit its type."""
        name = message.__msgtype__
        try:
            return bytes(self.store.serialize_cdr(message, name, little_endian=True))
        except (SerdeError, struct.error, AssertionError, AttributeError, TypeError, ValueError) as error:
            raise WireError(f"This {name} cannot be encoded: {error}") from error

    def decode(self, payload: bytes, type_name: str) -> Message:
        """The message; raises WireError on a wrong encapsulation, missing or left-over bytes, and numbers not finite.

        Where a type says that NaN is "not measured" (`NAN_IS_UNMEASURED`), NaN stays for the reader to judge. Of the
        types `CHECKED_BY_THE_READER` the numbers are left to the reader, one by one. Arrays are read-only views of
        `payload`.
        """
        self._known(type_name)
        try:
            message = self.store.deserialize_cdr(memoryview(payload), type_name)
        except (SerdeError, IndexError, OverflowError, MemoryError) as error:
            raise WireError(f"{len(payload)} bytes are not a {type_name} ({self.distribution}): {error}") from error
        _check_finite(message, type_name)
        return message

    def make(self, type_name: str, **fields: Any) -> Message:
        """A new message, every field that is not given having its ROS default: zero or empty."""
        self._known(type_name)
        definition = self.store.get_msgdef(type_name)
        unknown = fields.keys() - {name for name, _ in definition.fields}
        if unknown:
            raise WireError(f"{type_name} has no field {', '.join(sorted(unknown))}.")
        fields = DEFAULTS.get(type_name, {}) | fields
        return definition.cls(**{n: fields[n] if n in fields else self._zero(d) for n, d in definition.fields})

    def definition(self, type_name: str) -> str:
        """A message type's text with all that it uses, as MCAP's `ros2msg` schemas want it."""
        self._known(type_name)
        if "/msg/" not in type_name:
            raise WireError(f"{type_name} is part of a service or action: only messages have a ros2msg schema.")
        return str(self.store.generate_msgdef(type_name, ros_version=2)[0])

    def knows(self, type_name: str) -> bool:
        return type_name in self.store.fielddefs

    def warm_up(self, type_names: list[str]) -> None:
        """Compile the (de)serialisers now: the first use of a type takes up to 25 ms."""
        for name in type_names:
            self.decode(self.encode(self.make(name)), name)

    def _known(self, type_name: str) -> None:
        if not self.knows(type_name):
            raise WireError(f"No definition of {type_name} is known here ({self.distribution}).")

    def _zero(self, description: Any) -> Any:
        kind, detail = description
        if kind == Nodetype.NAME:
            return self.make(detail)
        if kind == Nodetype.BASE:
            return ZERO.get(detail[0], 0)
        (inner_kind, inner), length = detail
        count = length if kind == Nodetype.ARRAY else 0
        if inner_kind == Nodetype.BASE and inner[0] != "string":
            return np.zeros(count, dtype=NUMPY.get(inner[0], inner[0]))
        return [self._zero((inner_kind, inner)) for _ in range(count)]


@cache
def codec(distribution: str = "jazzy") -> Codec:
    """The codec of a distribution (`DISTRIBUTIONS`); the first call takes 75-240 ms."""
    if distribution not in BASE:
        raise WireError(f"ROS distribution should be one of {', '.join(DISTRIBUTIONS)}, got {distribution!r}.")
    return codec_with(distribution, definitions(distribution))


def codec_with(distribution: str, texts: Mapping[str, str]) -> Codec:
    """A codec of a distribution's own types and those of `texts`: type name -> definition, in order of need."""
    store = get_typestore(BASE[distribution])
    for name, text in texts.items():
        try:
            [fields] = get_types_from_msg(text, name).values()
            store.register({name: fields})  # under our name: rosbags would write a service's as pkg/srv/msg/Name
        except TypesysError as error:
            raise WireError(f"The definition of {name} is wrong: {error}") from error
    return Codec(distribution, store)


def encode(message: Message) -> bytes:
    """`Codec.encode` in the shapes of ROS 2 Jazzy."""
    return codec().encode(message)


def decode(payload: bytes, type_name: str) -> Message:
    """`Codec.decode` in the shapes of ROS 2 Jazzy."""
    return codec().decode(payload, type_name)


def make(type_name: str, **fields: Any) -> Message:
    """`Codec.make` in the shapes of ROS 2 Jazzy."""
    return codec().make(type_name, **fields)


def stamp_to_ns(stamp: Message) -> int:
    """builtin_interfaces/Time to nanoseconds."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def ns_to_stamp(stamp_ns: int) -> Message:
    """Nanoseconds to builtin_interfaces/Time."""
    seconds, nanoseconds = divmod(int(stamp_ns), 1_000_000_000)
    return make("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)


def header(stamp_ns: int, frame_id: str) -> Message:
    """std_msgs/Header."""
    return make("std_msgs/msg/Header", stamp=ns_to_stamp(stamp_ns), frame_id=frame_id)


def _check_finite(value: Any, path: str, *, or_nan: bool = False) -> None:
    """Every float of the message, however deep; images and clouds are bytes here and checked where they are read."""
    finite = True
    if isinstance(value, float):
        finite = math.isfinite(value) or (or_nan and math.isnan(value))
    elif isinstance(value, np.ndarray) and value.dtype.kind == "f":
        finite = bool((np.isfinite(value) | (or_nan & np.isnan(value))).all())
    elif isinstance(value, list):
        for item in value:
            _check_finite(item, f"{path}[]", or_nan=or_nan)
    elif hasattr(value, "__msgtype__") and value.__msgtype__ not in CHECKED_BY_THE_READER:
        or_nan = value.__msgtype__ in NAN_IS_UNMEASURED
        for name, item in vars(value).items():
            _check_finite(item, f"{path}.{name}", or_nan=or_nan)
    if not finite:
        raise WireError(f"{path} is not finite.")
