"""Datagrams in, clouds, IMU samples and the lidar's own state out. No socket, no thread, no clock."""

from __future__ import annotations

import struct
from collections import Counter, deque
from dataclasses import dataclass

from drivers.livox import control_wire
from drivers.livox.assembler import FrameAssembler, LivoxCloud, cloud_of
from drivers.livox.hms import HealthCode, parse_health
from drivers.livox.host_time import HostTime
from drivers.livox.keys import STATES, Key, word
from drivers.livox.packet_counter import PacketCounter
from drivers.livox.wire import DataPacket, DataType, LivoxWireError, PacketRefusal, TimeType, decode_imu, decode_packet
from openbelief.arrays import Array

KEPT_CLOUDS = 20  # two seconds
KEPT_IMU = 2000  # ten seconds at 200 Hz


@dataclass(frozen=True)
class LivoxImuSample:
    """gyro_rad_s, acceleration_m_s2: (3,) float64, IMU frame of the lidar. Stamps as in LivoxCloud."""

    stamp_ns: int
    gyro_rad_s: Array
    acceleration_m_s2: Array
    device_stamp_ns: int
    time_type: TimeType


@dataclass(frozen=True)
class LidarState:
    """What the lidar last said of itself; None where a push message left it out."""

    stamp_ns: int
    state: str | None = None
    core_temperature_c: float | None = None
    serial: str | None = None
    health: tuple[HealthCode, ...] = ()


class DatagramDecoder:
    """One lidar's streams. Everything kept is bounded; everything refused is counted by reason."""

    def __init__(self, frame_id: str) -> None:
        self.points, self.imu = PacketCounter(), PacketCounter()
        self.refused: Counter[PacketRefusal] = Counter()
        self.assembler = FrameAssembler()
        self.time, self.imu_time = HostTime(), HostTime()
        self.clock_changes = self.restarts = 0
        self.clouds: deque[LivoxCloud] = deque(maxlen=KEPT_CLOUDS)
        self.imu_samples: deque[LivoxImuSample] = deque(maxlen=KEPT_IMU)
        self.latest: LivoxCloud | None = None
        self.state: LidarState | None = None
        self.cloud_count = 0
        self._frame_id = frame_id

    def take_points(self, datagram: bytes, arrival_ns: int) -> None:
        packet = self._packet(datagram, self.points, arrival_ns, imu=False)
        finished = None if packet is None else self.assembler.add(packet)
        if finished is None:
            return
        self.latest = cloud_of(finished, self.time, frame_id=self._frame_id, sequence=self.cloud_count)
        self.cloud_count += 1
        self.clouds.append(self.latest)

    def take_imu(self, datagram: bytes, arrival_ns: int) -> None:
        packet = self._packet(datagram, self.imu, arrival_ns, imu=True)
        if packet is None:
            return
        try:
            gyro, acceleration = decode_imu(packet)
        except LivoxWireError as error:
            self.refused[error.refusal] += 1
            return
        stamp_ns, time_type = self.imu_time.to_host(packet.stamp_ns), TimeType(packet.time_type)
        self.imu_samples.append(LivoxImuSample(stamp_ns, gyro, acceleration, packet.stamp_ns, time_type))

    def take_push(self, datagram: bytes, arrival_ns: int) -> None:
        try:
            frame = control_wire.decode(datagram)
            if frame.command != control_wire.CommandId.PUSH or frame.is_ack:
                raise LivoxWireError(PacketRefusal.TYPE, f"Command {frame.command:#06x} is no push message.")
            self.state = lidar_state(control_wire.parse_values(frame.data), arrival_ns)
        except LivoxWireError as error:
            self.refused[error.refusal] += 1

    def _packet(self, datagram: bytes, counter: PacketCounter, arrival_ns: int, *, imu: bool) -> DataPacket | None:
        """The packet when it is whole, of this stream and new."""
        try:
            packet = decode_packet(datagram)
            if (packet.data_type == DataType.IMU) is not imu:
                raise LivoxWireError(PacketRefusal.TYPE, f"Data type {packet.data_type} does not belong on this port.")
        except LivoxWireError as error:
            self.refused[error.refusal] += 1
            return None
        if not counter.accept(packet):
            return None
        if packet is not counter.newest:
            return self._overtaken(packet, counter)
        time = self.imu_time if imu else self.time
        before = time.newest
        if time.observe(packet.stamp_ns, arrival_ns, source=packet.time_type) and not imu:
            self._count_change(packet, before)
            self.assembler.cut_off()
        return packet

    def _count_change(self, packet: DataPacket, before: tuple[int | None, int]) -> None:
        """Time since power-on falls where the lidar started anew; every other step is a clock that was set."""
        if packet.time_type == TimeType.UPTIME == before[0] and packet.stamp_ns < before[1]:
            self.restarts += 1
        else:
            self.clock_changes += 1

    def _overtaken(self, packet: DataPacket, counter: PacketCounter) -> DataPacket | None:
        """A packet that its successors overtook; None where they are already of another clock."""
        newest = counter.newest
        if newest is not None and newest.time_type != packet.time_type:
            self.assembler.cut += 1
            return None
        return packet


def lidar_state(values: dict[int, bytes], stamp_ns: int) -> LidarState:
    """Raises LivoxWireError where a known key has a wrong length."""
    state = _number("<B", values, Key.STATE)
    temperature = _number("<i", values, Key.CORE_TEMPERATURE)
    return LidarState(
        stamp_ns,
        state=None if state is None else word(STATES, state),
        core_temperature_c=None if temperature is None else temperature / 100,
        serial=control_wire.text(values[Key.SERIAL]) if Key.SERIAL in values else None,
        health=parse_health(values.get(Key.HMS, b"")),
    )


def _number(layout: str, values: dict[int, bytes], key: Key) -> int | None:
    if key not in values:
        return None
    if len(values[key]) != struct.calcsize(layout):
        raise LivoxWireError(PacketRefusal.LENGTH, f"Key {key.name} has {len(values[key])} bytes.")
    return int(struct.unpack(layout, values[key])[0])
