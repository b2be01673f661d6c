"""MID-360 data packets (Livox SDK2 protocol, little endian, packed): points of types 1-3 and IMU samples (type 0).

A packet is a 36-byte header and `dot_num` records. Its CRC-32 covers the time stamp and the records, bytes 28 to the
end; the vendor's SDK never checks it, we do. What the CRC leaves open (bytes 0-27) is cross-checked: version, length
against the datagram, and length against type and count; none of these can change a point unseen.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from enum import IntEnum, StrEnum
from typing import NamedTuple

import numpy as np

from openbelief.arrays import Array

HEADER = struct.Struct(
    "<BHHHHBBB12sIQ"
)  # version length interval dot_num udp_cnt frame_cnt type time_type - crc32 stamp
CRC_FROM = 28  # the CRC-32 covers the datagram from here to its end
STANDARD_GRAVITY = 9.80665  # m/s^2 in one g, the lidar's unit of acceleration


class DataType(IntEnum):
    """Header byte 10."""

    IMU = 0
    CARTESIAN_MM = 1  # the factory setting
    CARTESIAN_CM = 2
    SPHERICAL = 3


class TimeType(IntEnum):
    """Header byte 11: whose clock stamped the packet."""

    UPTIME = 0
    PTP = 1
    GPS = 2


_TAIL = [("reflectivity", "u1"), ("tag", "u1")]
RECORDS = {
    DataType.IMU: np.dtype([("gyro_rad_s", "<f4", 3), ("acceleration_g", "<f4", 3)]),
    DataType.CARTESIAN_MM: np.dtype([("xyz", "<i4", 3), *_TAIL]),
    DataType.CARTESIAN_CM: np.dtype([("xyz", "<i2", 3), *_TAIL]),
    DataType.SPHERICAL: np.dtype([("depth", "<u4"), ("theta", "<u2"), ("phi", "<u2"), *_TAIL]),
}
METRES = {DataType.CARTESIAN_MM: 1e-3, DataType.CARTESIAN_CM: 1e-2, DataType.SPHERICAL: 1e-3}
_SIZES = {int(kind): record.itemsize for kind, record in RECORDS.items()}


class PacketRefusal(StrEnum):
    """Why a datagram was refused; the receiver counts each."""

    SHORT = "too short"
    VERSION = "unknown version"
    LENGTH = "wrong length"
    TYPE = "unknown type"
    CHECKSUM = "wrong checksum"
    VALUE = "impossible value"


class LivoxWireError(ValueError):
    """A datagram that is not what it claims to be; `.refusal` names the kind, the message is one sentence."""

    def __init__(self, refusal: PacketRefusal, sentence: str) -> None:
        super().__init__(sentence)
        self.refusal = refusal


class DataPacket(NamedTuple):
    """One accepted packet. `stamp_ns` is the lidar's time of its first record, `interval_ns` first to last record."""

    data_type: int
    time_type: int
    dot_num: int
    udp_cnt: int
    stamp_ns: int
    interval_ns: int
    records: memoryview


class Points(NamedTuple):
    """xyz_m: (n, 3) float32, lidar frame, (0, 0, 0) = no return; offset_ns: (n,) int64 since the first stamp."""

    xyz_m: Array
    reflectivity: Array
    tag: Array
    offset_ns: Array


def decode_packet(datagram: bytes) -> DataPacket:
    """Raises LivoxWireError for anything that is not a whole, uncorrupted packet."""
    if len(datagram) < HEADER.size:
        raise LivoxWireError(
            PacketRefusal.SHORT, f"A data packet has {HEADER.size} bytes or more, this {len(datagram)}."
        )
    version, length, interval, dots, count, _, kind, time_type, _, crc, stamp_ns = HEADER.unpack_from(datagram)
    if version != 0:
        raise LivoxWireError(PacketRefusal.VERSION, f"Data packet version {version}; only version 0 is known.")
    size = _SIZES.get(kind)
    if size is None or time_type > TimeType.GPS:
        raise LivoxWireError(PacketRefusal.TYPE, f"Data type {kind} with time type {time_type} is unknown.")
    if length != len(datagram) or dots == 0 or length != HEADER.size + dots * size:
        raise LivoxWireError(
            PacketRefusal.LENGTH,
            f"{len(datagram)} bytes arrived, the header says {length} with {dots} records of {size}",
        )
    view = memoryview(datagram)
    if zlib.crc32(view[CRC_FROM:]) != crc:
        raise LivoxWireError(PacketRefusal.CHECKSUM, "The data packet's CRC-32 does not match its contents.")
    return DataPacket(kind, time_type, dots, count, stamp_ns, interval * 100, view[HEADER.size :])


def decode_points(packets: Sequence[DataPacket]) -> Points:
    """All points of packets of one point type, in packet order."""
    kind = DataType(packets[0].data_type)
    if kind is DataType.IMU or any(packet.data_type != kind for packet in packets):
        raise LivoxWireError(PacketRefusal.TYPE, "decode_points takes packets of one point type.")
    records = np.frombuffer(b"".join([packet.records for packet in packets]), dtype=RECORDS[kind])
    xyz = _spherical_xyz(records) if kind is DataType.SPHERICAL else records["xyz"] * np.float32(METRES[kind])
    return Points(
        xyz.astype(np.float32, copy=False), records["reflectivity"], records["tag"], _offsets_ns(packets, len(records))
    )


def _spherical_xyz(records: Array) -> Array:
    """depth, theta (from the z axis) and phi (from x towards y, both 0.01 degree) -> (n, 3) metres."""
    depth_m = records["depth"] * METRES[DataType.SPHERICAL]
    theta, phi = np.radians(records["theta"] * 0.01), np.radians(records["phi"] * 0.01)
    return np.column_stack(
        [depth_m * np.sin(theta) * np.cos(phi), depth_m * np.sin(theta) * np.sin(phi), depth_m * np.cos(theta)]
    )


def _offsets_ns(packets: Sequence[DataPacket], total: int) -> Array:
    """A packet's points are spread evenly from its stamp over its interval."""
    counts = np.array([packet.dot_num for packet in packets])
    starts = np.array([packet.stamp_ns - packets[0].stamp_ns for packet in packets], dtype=np.int64)
    steps = np.array([packet.interval_ns for packet in packets]) / np.maximum(counts - 1, 1)
    index = np.arange(total) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(starts, counts) + np.rint(index * np.repeat(steps, counts)).astype(np.int64)


def decode_imu(packet: DataPacket) -> tuple[Array, Array]:
    """(gyro (3,) rad/s, acceleration (3,) m/s^2), both float64, of a type-0 packet; raises LivoxWireError."""
    if packet.data_type != DataType.IMU or packet.dot_num != 1:
        raise LivoxWireError(PacketRefusal.TYPE, "An IMU packet holds exactly one record of type 0.")
    record = np.frombuffer(packet.records, dtype=RECORDS[DataType.IMU])[0]
    gyro, acceleration = record["gyro_rad_s"].astype(float), record["acceleration_g"] * STANDARD_GRAVITY
    if not (np.isfinite(gyro).all() and np.isfinite(acceleration).all()):
        raise LivoxWireError(PacketRefusal.VALUE, "The IMU packet holds a value that is not a number.")
    return gyro, acceleration


def encode_packet(
    kind: DataType,
    records: bytes,
    *,
    udp_cnt: int,
    stamp_ns: int,
    interval_ns: int = 0,
    time_type: TimeType = TimeType.UPTIME,
) -> bytes:
    """The datagram a lidar would send; `records` is a whole number of records of `kind`."""
    dots, rest = divmod(len(records), RECORDS[kind].itemsize)
    if rest or not dots:
        raise ValueError(f"{len(records)} bytes are no whole records of {RECORDS[kind].itemsize}.")
    covered = struct.pack("<Q", stamp_ns) + records
    length = CRC_FROM + len(covered)
    return (
        struct.pack(
            "<BHHHHBBB12xI",
            0,
            length,
            interval_ns // 100,
            dots,
            udp_cnt & 0xFFFF,
            0,
            kind,
            time_type,
            zlib.crc32(covered),
        )
        + covered
    )


def encode_records(kind: DataType, xyz_m: Array, reflectivity: Array, tag: Array) -> Array:
    """(n,) records of a point type from (n, 3) metres; rounds to the type's resolution."""
    records = np.zeros(len(xyz_m), dtype=RECORDS[kind])
    if kind is DataType.SPHERICAL:
        depth = np.linalg.norm(xyz_m, axis=1)
        records["depth"] = np.rint(depth / METRES[kind])
        theta = np.arccos(np.divide(xyz_m[:, 2], depth, out=np.ones_like(depth), where=depth > 0))
        records["theta"] = np.rint(np.degrees(theta) * 100)
        records["phi"] = np.rint(np.degrees(np.arctan2(xyz_m[:, 1], xyz_m[:, 0])) * 100 % 36000) % 36000
    else:
        records["xyz"] = np.rint(xyz_m / METRES[kind])
    records["reflectivity"], records["tag"] = reflectivity, tag
    return records


def encode_imu_record(gyro_rad_s: Array, acceleration_m_s2: Array) -> bytes:
    """One type-0 record; the wire carries acceleration in g."""
    return struct.pack("<6f", *gyro_rad_s, *(np.asarray(acceleration_m_s2) / STANDARD_GRAVITY))
