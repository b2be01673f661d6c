"""Writers of the containers that other recorders make, from a walk's messages."""

from __future__ import annotations

import bz2
import sqlite3
import struct
from pathlib import Path

import pytest
import zstandard

from drivers.ros.messages import codec, encode


class Writers:
    """Each writes a walk's messages, in the order of logging."""

    @staticmethod
    def sqlite(walk, path: Path) -> Path:
        """What rosbag2_storage_sqlite3 writes."""
        with sqlite3.connect(path) as db:
            db.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT,type TEXT,serialization_format TEXT)")
            db.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER,timestamp INTEGER,data BLOB)")
            numbers: dict[str, int] = {}
            for topic, at_ns, message in sorted(walk.messages, key=lambda m: m[1]):
                if topic not in numbers:
                    numbers[topic] = len(numbers) + 1
                    db.execute("INSERT INTO topics VALUES(?,?,?,'cdr')", (numbers[topic], topic, message.__msgtype__))
                row = (numbers[topic], at_ns, encode(message))
                db.execute("INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)", row)
        db.close()
        return path

    @staticmethod
    def ros1(walk, path: Path, compression: str = "none", chunk: int = 5) -> Path:
        """A bag 2.0 as rosbag writes it, its index left out: `rosbag record` that was killed."""
        out = b"#ROSBAG V2.0\n" + record({"op": b"\x03", "index_pos": bytes(8), "conn_count": bytes(4)}, b" " * 64)
        numbers: dict[str, int] = {}
        inside: list[bytes] = []
        messages = sorted(walk.messages, key=lambda m: m[1])
        for i, (topic, at_ns, message) in enumerate(messages):
            if topic not in numbers:
                numbers[topic] = len(numbers)
                inside.append(connection(numbers[topic], topic, message.__msgtype__.replace("/msg/", "/")))
            time = struct.pack("<II", at_ns // 10**9, at_ns % 10**9)
            fields = {"op": b"\x02", "conn": struct.pack("<I", numbers[topic]), "time": time}
            inside.append(record(fields, as_ros1(message)))
            if i % chunk == chunk - 1 or i == len(messages) - 1:
                data, inside = b"".join(inside), []
                packed = {"none": bytes, "bz2": bz2.compress, "lz4": lz4}[compression](data)
                fields = {"op": b"\x05", "compression": compression.encode(), "size": struct.pack("<I", len(data))}
                out += record(fields, packed)
        path.write_bytes(out)
        return path

    @staticmethod
    def zstd(path: Path) -> Path:
        packed = path.with_name(path.name + ".zstd")
        packed.write_bytes(zstandard.ZstdCompressor().compress(path.read_bytes()))
        return packed


def lz4(data: bytes) -> bytes:
    import lz4.frame

    return lz4.frame.compress(data)


def as_ros1(message) -> bytes:
    """The message as ROS 1 sends it: a header has a sequence number there."""
    return bytes(codec().store.cdr_to_ros1(encode(message), message.__msgtype__))


def record(fields: dict[str, bytes], data: bytes) -> bytes:
    header = b"".join(struct.pack("<I", len(n) + 1 + len(v)) + n.encode() + b"=" + v for n, v in fields.items())
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def connection(number: int, topic: str, type_name: str) -> bytes:
    about = {"topic": topic.encode(), "type": type_name.encode(), "md5sum": b"*", "message_definition": b""}
    data = b"".join(struct.pack("<I", len(n) + 1 + len(v)) + n.encode() + b"=" + v for n, v in about.items())
    return record({"op": b"\x07", "conn": struct.pack("<I", number), "topic": topic.encode()}, data)


@pytest.fixture
def write() -> type[Writers]:
    return Writers
