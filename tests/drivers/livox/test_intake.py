"""Datagrams to clouds, IMU samples and state; what a bad cable does to them, and what it must not do."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from drivers.livox import control_wire
from drivers.livox.assembler import MAX_PACKETS
from drivers.livox.intake import KEPT_CLOUDS, DatagramDecoder
from drivers.livox.wire import DataType, PacketRefusal, TimeType, encode_packet
from sim_fakes.sensors.livox_faults import LivoxFaults

SECOND = 1_000_000_000
ZERO = 1_700_000_000 * SECOND


def points_packet(stamp_ns: int, *records: tuple[int, int, int, int], count: int = 0) -> bytes:
    body = b"".join(struct.pack("<iiiBB", x, y, z, 9, tag) for x, y, z, tag in records)
    return encode_packet(DataType.CARTESIAN_MM, body, udp_cnt=count, stamp_ns=stamp_ns)


def one_cloud(*records: tuple[int, int, int, int]):
    intake = DatagramDecoder("lidar")
    intake.take_points(points_packet(0, *records), ZERO)
    intake.take_points(points_packet(SECOND // 10, (1, 1, 1, 0), count=1), ZERO + SECOND // 10)
    assert intake.latest is not None
    return intake.latest


def on_the_room(points: np.ndarray) -> np.ndarray:
    """(n,) distance of each point to the nearest surface of the open room."""
    x, y, z = np.abs(points[:, 0] - 0), np.abs(points[:, 1]), points[:, 2]
    return np.minimum(np.minimum(np.abs(x - 3), np.abs(y - 2)), np.abs(z + 1.2))


def test_a_second_of_lidar_is_ten_clouds_at_its_own_pace(stream, take) -> None:
    intake = DatagramDecoder("lidar")
    take(intake, stream().due(SECOND + 1_000_000), ZERO + SECOND)
    assert intake.cloud_count == 10
    starts = [cloud.device_stamp_ns for cloud in intake.clouds]
    assert np.abs(np.diff(starts) - SECOND // 10).max() < 500_000
    assert all(207 <= cloud.packets <= 209 for cloud in intake.clouds)
    assert [cloud.sequence for cloud in intake.clouds] == list(range(10))


@pytest.mark.parametrize("kind", [DataType.CARTESIAN_MM, DataType.CARTESIAN_CM, DataType.SPHERICAL])
def test_every_point_type_shows_the_room(stream, take, kind: DataType) -> None:
    intake = DatagramDecoder("lidar")
    take(intake, stream(data_type=kind).due(SECOND // 5), ZERO)
    assert len(intake.latest.points) > 10_000
    assert on_the_room(intake.latest.points).max() < 0.02


def test_no_returns_and_doubtful_points_are_left_out_and_counted() -> None:
    cloud = one_cloud((1000, 0, 0, 0), (0, 0, 0, 0), (2000, 0, 0, 0x01), (3000, 0, 0, 0x20), (0, 0, 0, 0x04))
    np.testing.assert_allclose(cloud.points, [[1, 0, 0], [3, 0, 0]])
    assert (cloud.no_returns, cloud.doubtful) == (2, 1)
    assert len(cloud.offset_ns) == len(cloud.reflectivity) == 2


@pytest.mark.parametrize("tag", [0x01, 0x02, 0x04, 0x08, 0x0F])
def test_each_of_the_low_four_tag_bits_drops_the_point(tag: int) -> None:
    assert len(one_cloud((1000, 0, 0, tag)).points) == 0


def test_a_lidar_that_sees_nothing_gives_empty_clouds_not_none(stream, take) -> None:
    intake = DatagramDecoder("lidar")
    take(intake, stream(lambda rays, uptime_ns: np.zeros(len(rays))).due(SECOND // 5), ZERO)
    assert intake.latest.points.shape == (0, 3)


def test_point_times_run_through_the_frame(stream, take) -> None:
    intake = DatagramDecoder("lidar")
    take(intake, stream().due(SECOND // 5), ZERO)
    offsets = intake.latest.offset_ns
    assert (np.diff(offsets) >= 0).all()
    assert 0 <= offsets[0] < 1_000_000 < 99_000_000 < offsets[-1] < 101_000_000


@pytest.mark.parametrize("time_type", list(TimeType))
def test_stamps_are_in_our_clock_and_whose_clock_gave_them_is_kept(stream, take, time_type: TimeType) -> None:
    intake = DatagramDecoder("lidar")
    lidar = stream(time_type=time_type)
    for step in range(1, 101):
        take(intake, lidar.due(step * SECOND // 100), ZERO + step * SECOND // 100)
    cloud = intake.latest
    assert abs(cloud.stamp_ns - ZERO - cloud.device_stamp_ns) < 1_000_000
    assert cloud.time_type is time_type
    assert intake.imu_samples[-1].time_type is time_type
    assert abs(intake.imu_samples[-1].stamp_ns - ZERO - SECOND) < 1_000_000


def test_the_imu_runs_at_200_hz_and_feels_gravity(stream, take) -> None:
    intake = DatagramDecoder("lidar")
    take(intake, stream().due(SECOND - 1), ZERO)
    assert len(intake.imu_samples) == 200
    np.testing.assert_allclose(intake.imu_samples[3].acceleration_m_s2, [0, 0, 9.80665], rtol=1e-6)


def test_a_push_message_tells_state_temperature_and_health(stream, take) -> None:
    intake = DatagramDecoder("lidar")
    lidar = stream()
    lidar.health = (0x01040002,)
    take(intake, lidar.due(0), ZERO)
    state = intake.state
    assert (state.state, state.core_temperature_c, state.serial) == ("sampling", 45.25, "SN1")
    assert ["window" in str(code) for code in state.health] == [True]


def test_what_is_no_push_message_is_refused() -> None:
    intake = DatagramDecoder("lidar")
    intake.take_push(control_wire.encode(control_wire.set_request(1, {})), ZERO)
    intake.take_push(control_wire.encode(control_wire.push_request(1, {0x8007: b"\1"})), ZERO)
    intake.take_push(b"\xaa", ZERO)
    assert intake.state is None
    assert intake.refused == {PacketRefusal.TYPE: 1, PacketRefusal.LENGTH: 1, PacketRefusal.SHORT: 1}


def test_a_packet_on_the_wrong_port_is_refused(stream) -> None:
    intake = DatagramDecoder("lidar")
    for channel, datagram in stream().due(10_000_000):
        if channel == "points":
            intake.take_imu(datagram, ZERO)
    assert intake.refused[PacketRefusal.TYPE] > 10
    assert not intake.imu_samples


def test_dropped_packets_are_counted_exactly(stream, take) -> None:
    lidar, faults = stream(first_count=65_000), LivoxFaults(seed=1, drop=0.05)
    intake = DatagramDecoder("lidar")
    take(intake, lidar.due(SECOND), ZERO)
    take(intake, faults.apply(lidar.due(2 * SECOND)), ZERO)
    take(intake, lidar.due(3 * SECOND), ZERO)
    assert faults.counts["drop"] > 50
    assert intake.points.lost + intake.imu.lost == faults.counts["drop"]


def test_duplicates_and_swaps_change_no_point(stream, take) -> None:
    clean, troubled = DatagramDecoder("lidar"), DatagramDecoder("lidar")
    faults = LivoxFaults(seed=2, duplicate=0.1, reorder=0.1)
    take(clean, stream().due(SECOND), ZERO)
    take(troubled, faults.apply(stream().due(SECOND)), ZERO)
    assert troubled.points.duplicates > 100 < troubled.points.out_of_order
    assert troubled.points.lost == 0
    late = troubled.assembler.late
    assert late < 10
    kept = sum(len(cloud.points) for cloud in troubled.clouds)
    assert sum(len(cloud.points) for cloud in clean.clouds) - kept <= 96 * (late + 2)
    assert all(on_the_room(cloud.points).max() < 0.01 for cloud in troubled.clouds)


def test_damaged_packets_never_become_points(stream, take) -> None:
    faults = LivoxFaults(seed=3, flip=0.2, truncate=0.1, wrong_version=0.1)
    intake = DatagramDecoder("lidar")
    take(intake, faults.apply(stream().due(SECOND)), ZERO)
    assert set(intake.refused) >= {
        PacketRefusal.CHECKSUM,
        PacketRefusal.LENGTH,
        PacketRefusal.VERSION,
        PacketRefusal.SHORT,
    }
    assert intake.cloud_count >= 9
    assert all(on_the_room(cloud.points).max() < 0.01 for cloud in intake.clouds)


@pytest.mark.parametrize("ran_s", [0.4, 3.0])
def test_a_lidar_that_restarts_gives_clouds_again(stream, take, ran_s: float) -> None:
    intake = DatagramDecoder("lidar")
    take(intake, stream().due(round(ran_s * SECOND)), ZERO)
    before = intake.cloud_count
    take(intake, stream().due(SECOND), ZERO + 10 * SECOND)
    assert intake.cloud_count >= before + 9  # the last of before was cut off
    assert abs(intake.latest.stamp_ns - (ZERO + 10 * SECOND)) < SECOND
    assert (intake.restarts, intake.clock_changes) == (1, 0)


def test_what_nobody_takes_is_bounded(stream, take) -> None:
    intake = DatagramDecoder("lidar")
    take(intake, stream().due(4 * SECOND), ZERO)
    assert len(intake.clouds) == KEPT_CLOUDS
    assert intake.clouds[-1].sequence == intake.cloud_count - 1


def test_a_clock_that_stands_still_fills_no_memory_and_gives_no_cloud() -> None:
    intake = DatagramDecoder("lidar")
    for count in range(3 * MAX_PACKETS):
        intake.take_points(points_packet(5, (1, 1, 1, 0), count=count), ZERO + count)
    assert intake.assembler.overfull >= 2
    assert intake.latest is None


CLOCKS = {
    "uptime to PTP": ((100 * SECOND, TimeType.UPTIME), (ZERO, TimeType.PTP)),
    "PTP to uptime": ((ZERO, TimeType.PTP), (100 * SECOND, TimeType.UPTIME)),
    "GPS to PTP": ((ZERO - 3 * SECOND, TimeType.GPS), (ZERO, TimeType.PTP)),
    "PTP to GPS, nearly alike": ((ZERO, TimeType.PTP), (ZERO + 1_000_000, TimeType.GPS)),
    "TAI to UTC": ((ZERO + 37 * SECOND, TimeType.PTP), (ZERO, TimeType.PTP)),
    "UTC to TAI": ((ZERO, TimeType.PTP), (ZERO + 37 * SECOND, TimeType.PTP)),
    "slewed back": ((ZERO, TimeType.PTP), (ZERO - 30_000_000, TimeType.PTP)),
    "set ahead by less than a second": ((ZERO, TimeType.PTP), (ZERO + 600_000_000, TimeType.PTP)),
    "restarted": ((500 * SECOND, TimeType.UPTIME), (0, TimeType.UPTIME)),
}


@pytest.mark.parametrize("clocks", CLOCKS.values(), ids=CLOCKS)
@pytest.mark.parametrize("imu_read_late", [False, True])
def test_a_change_of_the_lidars_clock_puts_nothing_into_another_time(clocks, imu_read_late) -> None:
    """Every stamp lies in the half second in which all came; what was cut off is counted."""
    intake, step, change = DatagramDecoder("lidar"), 480_000, 600
    imu, packets = bytes(24), []
    for i in range(1200):
        zero, source = clocks[i >= change]
        arrival = ZERO + i * step + 300_000
        body = struct.pack("<iiiBB", 1000, 0, 0, 9, 0)
        points = encode_packet(DataType.CARTESIAN_MM, body, udp_cnt=i, stamp_ns=zero + i * step, time_type=source)
        intake.take_points(points, arrival)
        if i % 10 == 0:
            sample = encode_packet(DataType.IMU, imu, udp_cnt=i // 10, stamp_ns=zero + i * step, time_type=source)
            packets.append((arrival, sample))
        if i % 100 == 99:  # its socket is drained now and then
            for at, sample in packets:
                intake.take_imu(sample, arrival if imu_read_late else at)
            packets = []
    stamps = [cloud.stamp_ns for cloud in intake.clouds] + [sample.stamp_ns for sample in intake.imu_samples]
    late_ns = 50_000_000 if imu_read_late else 1_000_000
    assert all(-1_000_000 <= stamp - ZERO <= 1200 * step + late_ns for stamp in stamps)
    assert len(intake.clouds) >= 4 and len(intake.imu_samples) == 120
    started_anew = clocks == CLOCKS["restarted"]
    assert (intake.clock_changes, intake.restarts) == ((0, 1) if started_anew else (1, 0))
    assert 0 < intake.assembler.cut < 209


def test_packets_of_the_old_clock_that_were_overtaken_are_left_out_and_counted() -> None:
    intake, step = DatagramDecoder("lidar"), 480_000
    order = [*range(595), *range(600, 605), *range(595, 600), *range(605, 1200)]
    for place, i in enumerate(order):
        zero, source = (100 * SECOND, TimeType.UPTIME) if i < 600 else (ZERO, TimeType.PTP)
        body = struct.pack("<iiiBB", 1000, 0, 0, 9, 0)
        packet = encode_packet(DataType.CARTESIAN_MM, body, udp_cnt=i, stamp_ns=zero + i * step, time_type=source)
        intake.take_points(packet, ZERO + place * step + 300_000)
    assert intake.clock_changes == 1
    assert all(0 <= cloud.stamp_ns - ZERO <= 1200 * step for cloud in intake.clouds)
