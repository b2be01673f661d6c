"""ROS 1 bags (format 2.0), read in file order and without their index, so that a bag that was never closed reads too.

Source of the layout: wiki.ros.org/Bags/Format/2.0. Messages come out as ROS 2 ones: CDR, types named pkg/msg/Type.
"""

from __future__ import annotations

import bz2
import struct
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from rosbags.serde import SerdeError

from drivers.ros.messages import codec
from logs.mcap_io.reader import LogMessage
from logs.mcap_io.scan import MAX_CHUNK_BYTES

MESSAGE, CHUNK, CONNECTION = 2, 5, 7
LENGTH = struct.Struct("<I")
MAX_HEADER_BYTES = 1 << 20
VERSION = b"#ROSBAG V2.0\n"
RENAMED = {"tf/msg/tfMessage": "tf2_msgs/msg/TFMessage"}


class BagDamage(Exception):
    """The bytes are no record of a bag; the text says where."""


@dataclass(frozen=True)
class _Record:
    fields: dict[bytes, bytes]
    data: bytes

    @property
    def kind(self) -> int:
        return self.number(b"op", "<B")

    def number(self, name: bytes, layout: str) -> int:
        try:
            return int(struct.unpack(layout, self.fields[name])[0])
        except (KeyError, struct.error) as error:
            raise BagDamage(f"a record has no {name.decode()}") from error


class Ros1Bag:
    """A .bag, also one without an index (.bag.active): `Part`."""

    kind = "ROS 1 bag"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.damage: str | None = None

    def messages(self, topics: Collection[str] | None = None) -> Iterator[LogMessage]:
        connections: dict[int, tuple[str, str]] = {}
        sequence = 0
        try:
            for record in self._records():
                if record.kind == CONNECTION:
                    connections[record.number(b"conn", "<I")] = _connection(record)
                elif record.kind == MESSAGE:
                    topic, type_name = self._of(connections, record)
                    sequence += 1
                    if topics is None or topic in topics:
                        time_ns = _time_ns(record)
                        yield as_ros2(LogMessage(topic, type_name, "ros1", time_ns, time_ns, sequence, record.data))
        except BagDamage as error:
            self.damage = f"{error} (rosbag reindex mends an index, rosbag fix a bag)"

    def topics(self) -> dict[str, str]:
        found: dict[str, str] = {}
        try:
            for record in self._records():
                if record.kind == CONNECTION:
                    topic, type_name = _connection(record)
                    found[topic] = ros2_name(type_name)
        except BagDamage as error:
            self.damage = str(error)
        return found

    @staticmethod
    def _of(connections: dict[int, tuple[str, str]], record: _Record) -> tuple[str, str]:
        number = record.number(b"conn", "<I")
        if number not in connections:
            raise BagDamage(f"a message belongs to connection {number}, which is nowhere defined")
        return connections[number]

    def _records(self) -> Iterator[_Record]:
        """The records of the file, and those inside its chunks in place of the chunks."""
        with self.path.open("rb") as file:
            version = file.read(len(VERSION))
            if version != VERSION:
                raise BagDamage(f"it is of another version ({version[:12]!r}); 2.0 can be read: rosbag migrate")
            while True:
                at = file.tell()
                record = _record(file, at)
                if record is None:
                    return
                if record.kind == CHUNK:
                    yield from _inside(record, at)
                else:
                    yield record


def as_ros2(message: LogMessage) -> LogMessage:
    """A ROS 1 message as CDR where its type is known; others keep their bytes and the encoding "ros1"."""
    name = ros2_name(message.type_name)
    encoding, payload = message.encoding, message.payload
    if codec().knows(name):
        try:
            encoding, payload = "cdr", bytes(codec().store.ros1_to_cdr(payload, name))
        except (SerdeError, IndexError, OverflowError, MemoryError, struct.error, ValueError):
            encoding = "ros1"  # it is not its type: whoever wants it counts it as unreadable
    stamps = message.stamp_ns, message.log_time_ns, message.sequence
    return LogMessage(message.topic, name, encoding, *stamps, payload)


def ros2_name(name: str) -> str:
    """sensor_msgs/Image -> sensor_msgs/msg/Image, and the types that were renamed since."""
    package, _, kind = name.partition("/")
    full = name if "/msg/" in name or not kind else f"{package}/msg/{kind}"
    return RENAMED.get(full, full)


def _connection(record: _Record) -> tuple[str, str]:
    """(topic, ROS 1 type) of a connection record."""
    about = _fields(record.data)
    try:
        return "/" + record.fields[b"topic"].decode().lstrip("/"), about[b"type"].decode()
    except (KeyError, UnicodeDecodeError) as error:
        raise BagDamage("a connection has no topic or type") from error


def _time_ns(record: _Record) -> int:
    both = record.number(b"time", "<Q")
    return (both & 0xFFFFFFFF) * 1_000_000_000 + (both >> 32)


def _record(file: BinaryIO, at: int) -> _Record | None:
    """The record at the file's position, None at its end."""
    if not (start := file.read(LENGTH.size)):
        return None
    header = _read(file, at, start, MAX_HEADER_BYTES)
    if not header:
        raise BagDamage(f"no record begins at byte {at}")
    return _Record(_fields(header), _read(file, at, file.read(LENGTH.size), MAX_CHUNK_BYTES))


def _read(file: BinaryIO, at: int, length: bytes, limit: int) -> bytes:
    if len(length) < LENGTH.size:
        raise BagDamage(f"it breaks off in the record at byte {at}")
    [size] = LENGTH.unpack(length)
    if size > limit:
        raise BagDamage(f"the record at byte {at} has {size} bytes, more than the limit of {limit}")
    data = file.read(size)
    if len(data) < size:
        raise BagDamage(f"it breaks off in the record at byte {at}")
    return data


def _fields(header: bytes) -> dict[bytes, bytes]:
    fields, at = {}, 0
    while at < len(header):
        end = at + LENGTH.size + int.from_bytes(header[at : at + LENGTH.size], "little")
        name, separator, value = header[at + LENGTH.size : end].partition(b"=")
        if not separator or end > len(header):
            raise BagDamage("a record's header is damaged")
        fields[name] = value
        at = end
    return fields


def _inside(chunk: _Record, at: int) -> Iterator[_Record]:
    from io import BytesIO

    compression = chunk.fields.get(b"compression", b"none").decode("latin-1")
    size = chunk.number(b"size", "<I")
    if compression not in EXPANDERS:
        raise BagDamage(f"the chunk at byte {at} is compressed with {compression!r}, which is unknown")
    if size > MAX_CHUNK_BYTES:
        raise BagDamage(
            f"the chunk at byte {at} would expand to {size} bytes, more than the limit of {MAX_CHUNK_BYTES}"
        )
    try:
        data = EXPANDERS[compression](chunk.data, size)
    except (OSError, EOFError, RuntimeError, ValueError) as error:
        raise BagDamage(f"the chunk at byte {at} cannot be decompressed") from error
    if len(data) != size:
        raise BagDamage(f"the chunk at byte {at} holds {len(data)} bytes and promised {size}")
    inner = BytesIO(data)
    while (record := _record(inner, inner.tell())) is not None:
        yield record


def _bz2(data: bytes, size: int) -> bytes:
    return bz2.BZ2Decompressor().decompress(data, max_length=size + 1)


def _lz4(data: bytes, size: int) -> bytes:
    import lz4.frame  # type: ignore[import-untyped]

    return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1))


EXPANDERS: dict[str, Callable[[bytes, int], Any]] = {"none": lambda data, _size: data, "bz2": _bz2, "lz4": _lz4}
