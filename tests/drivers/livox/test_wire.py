"""Data packets: known bytes, every point type, and no flipped bit that changes a point unseen."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest

from drivers.livox.wire import (
    DataType,
    LivoxWireError,
    PacketRefusal,
    TimeType,
    decode_imu,
    decode_packet,
    decode_points,
    encode_imu_record,
    encode_packet,
    encode_records,
)

POINT_TYPES = [DataType.CARTESIAN_MM, DataType.CARTESIAN_CM, DataType.SPHERICAL]
RESOLUTION_M = {DataType.CARTESIAN_MM: 0.001, DataType.CARTESIAN_CM: 0.01, DataType.SPHERICAL: 0.003}
# version, length 64, interval 10, 2 points, count 513, frame 0, type 1, time type 1 | crc | stamp 1e9+1 | two points
HEAD = "00 4000 0a00 0200 0102 00 01 01" + "00" * 12
STAMP = "01ca9a3b00000000"
TWO_POINTS = "e8030000 18fcffff f4010000 64 00" + "00000000 00000000 00000000 00 10"


def golden() -> bytes:
    covered = bytes.fromhex(STAMP + TWO_POINTS)
    return bytes.fromhex(HEAD) + struct.pack("<I", zlib.crc32(covered)) + covered


def packet_of(kind: DataType) -> bytes:
    if kind is DataType.IMU:
        return encode_packet(kind, encode_imu_record(np.array([0.1, 0.2, 0.3]), np.zeros(3)), udp_cnt=7, stamp_ns=5)
    rng = np.random.default_rng(3)
    records = encode_records(kind, rng.uniform(-9, 9, (96, 3)), np.full(96, 50), np.zeros(96))
    return encode_packet(kind, records.tobytes(), udp_cnt=7, stamp_ns=5, interval_ns=475_000)


def flips(datagram: bytes):
    for byte in range(len(datagram)):
        for bit in range(8):
            yield byte, datagram[:byte] + bytes([datagram[byte] ^ 1 << bit]) + datagram[byte + 1 :]


def test_a_known_packet_reads_as_its_fields() -> None:
    packet = decode_packet(golden())
    assert packet[:6] == (DataType.CARTESIAN_MM, TimeType.PTP, 2, 513, 1_000_000_001, 1000)
    points = decode_points([packet])
    np.testing.assert_allclose(points.xyz_m, [[1.0, -1.0, 0.5], [0, 0, 0]])
    assert points.reflectivity.tolist() == [100, 0]
    assert points.tag.tolist() == [0, 16]
    assert points.offset_ns.tolist() == [0, 1000]


def test_the_encoder_writes_the_known_packet() -> None:
    written = encode_packet(
        DataType.CARTESIAN_MM,
        bytes.fromhex(TWO_POINTS),
        udp_cnt=513,
        stamp_ns=1_000_000_001,
        interval_ns=1000,
        time_type=TimeType.PTP,
    )
    assert written == golden()


@pytest.mark.parametrize("kind", POINT_TYPES)
def test_points_come_back_within_their_types_resolution(kind: DataType) -> None:
    rng = np.random.default_rng(1)
    xyz = rng.uniform(-8, 8, (96, 3))
    tags = rng.integers(0, 64, 96)
    datagram = encode_packet(
        kind, encode_records(kind, xyz, np.arange(96), tags).tobytes(), udp_cnt=70_000, stamp_ns=1, interval_ns=475_000
    )
    packet = decode_packet(datagram)
    points = decode_points([packet, packet])
    np.testing.assert_allclose(points.xyz_m, np.vstack([xyz, xyz]), atol=RESOLUTION_M[kind])
    assert points.xyz_m.dtype == np.float32
    assert points.tag.tolist() == [*tags, *tags]
    assert packet.udp_cnt == 70_000 - 65_536


def test_spherical_angles_are_theta_from_the_z_axis_and_phi_from_x_to_y() -> None:
    record = struct.pack("<IHHBB", 2000, 9000, 9000, 1, 0) + struct.pack("<IHHBB", 3000, 0, 0, 1, 0)
    points = decode_points([decode_packet(encode_packet(DataType.SPHERICAL, record, udp_cnt=0, stamp_ns=0))])
    np.testing.assert_allclose(points.xyz_m, [[0, 2, 0], [0, 0, 3]], atol=1e-6)


def test_every_point_has_its_own_time() -> None:
    record = struct.pack("<iiiBB", 1, 1, 1, 0, 0)
    packets = [
        decode_packet(encode_packet(DataType.CARTESIAN_MM, record * 3, udp_cnt=0, stamp_ns=1000, interval_ns=600)),
        decode_packet(encode_packet(DataType.CARTESIAN_MM, record, udp_cnt=1, stamp_ns=2000, interval_ns=600)),
    ]
    assert decode_points(packets).offset_ns.tolist() == [0, 300, 600, 1000]


def test_acceleration_arrives_in_metres_per_second_squared() -> None:
    record = struct.pack("<6f", 0.5, -0.25, 0, 0, 0, 1.0)
    gyro, acceleration = decode_imu(decode_packet(encode_packet(DataType.IMU, record, udp_cnt=0, stamp_ns=0)))
    np.testing.assert_allclose(gyro, [0.5, -0.25, 0])
    np.testing.assert_allclose(acceleration, [0, 0, 9.80665])


def test_an_imu_value_that_is_no_number_is_refused() -> None:
    record = struct.pack("<6f", 0, 0, 0, float("nan"), 0, 1.0)
    packet = decode_packet(encode_packet(DataType.IMU, record, udp_cnt=0, stamp_ns=0))
    with pytest.raises(LivoxWireError) as refused:
        decode_imu(packet)
    assert refused.value.refusal is PacketRefusal.VALUE


@pytest.mark.parametrize("kind", list(DataType))
def test_no_flipped_bit_changes_a_record_or_its_stamp_unseen(kind: DataType) -> None:
    good = packet_of(kind)
    intact = decode_packet(good)
    open_bytes = {
        3,
        4,
        7,
        8,
        9,
        11,
        *range(12, 24),
    }  # interval, counter, frame, time type, reserved: no CRC covers them
    passed = set()
    for byte, bad in flips(good):
        try:
            packet = decode_packet(bad)
        except LivoxWireError:
            continue
        passed.add(byte)
        assert packet.records == intact.records
        assert (packet.data_type, packet.dot_num, packet.stamp_ns) == (kind, intact.dot_num, 5)
    assert passed <= open_bytes


@pytest.mark.parametrize("kind", list(DataType))
def test_every_truncation_is_refused(kind: DataType) -> None:
    good = packet_of(kind)
    for wrong in [*(good[:length] for length in range(len(good))), good + b"\0"]:
        with pytest.raises(LivoxWireError) as refused:
            decode_packet(wrong)
        assert refused.value.refusal is (PacketRefusal.SHORT if len(wrong) < 36 else PacketRefusal.LENGTH)


@pytest.mark.parametrize(
    ("byte", "value", "refusal"),
    [
        (0, 1, PacketRefusal.VERSION),
        (1, 9, PacketRefusal.LENGTH),
        (5, 95, PacketRefusal.LENGTH),
        (10, 4, PacketRefusal.TYPE),
        (11, 3, PacketRefusal.TYPE),
    ],
)
def test_a_refusal_says_why(byte: int, value: int, refusal: PacketRefusal) -> None:
    bad = bytearray(packet_of(DataType.CARTESIAN_MM))
    bad[byte] = value
    with pytest.raises(LivoxWireError) as refused:
        decode_packet(bytes(bad))
    assert refused.value.refusal is refusal
