"""The datagrams a MID-360 sends of itself, as a function of its uptime: points, IMU, push messages, discovery."""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np

from drivers.livox import control_wire
from drivers.livox.control_wire import Found
from drivers.livox.keys import SAMPLING, Key
from drivers.livox.wire import (
    STANDARD_GRAVITY,
    DataType,
    TimeType,
    encode_imu_record,
    encode_packet,
    encode_records,
)
from openbelief.arrays import Array
from sim_fakes.sensors.livox_scan import RangeSource, directions

DOTS = 96  # points of a packet
TILE = 208  # packets scanned at once: a tenth of a second
SECOND_NS = 1_000_000_000
GRAVITY_UP = np.array([0.0, 0.0, STANDARD_GRAVITY])


class Outgoing(NamedTuple):
    """One datagram on its way out of the lidar's port named `channel`."""

    channel: str
    datagram: bytes


class StreamTick:
    """Numbers the events of a fixed rate: `due(t)` yields (number, time) of those up to t not yet told."""

    def __init__(self, per_second: float) -> None:
        self._rate, self._next = per_second, 0

    def time_ns(self, number: int) -> int:
        return round(number * SECOND_NS / self._rate)

    def due(self, until_ns: int) -> list[tuple[int, int]]:
        told = []
        while (time_ns := self.time_ns(self._next)) <= until_ns:
            told.append((self._next, time_ns))
            self._next += 1
        return told


class LivoxStream:
    """`due(uptime_ns)` gives, oldest first, what is to be sent until then. `health` are the raw HMS codes to report."""

    def __init__(
        self,
        ranges: RangeSource,
        found: Found,
        *,
        data_type: DataType = DataType.CARTESIAN_MM,
        time_type: TimeType = TimeType.UPTIME,
        points_per_s: int = 200_000,
        first_count: int = 0,
    ) -> None:
        self.work_state, self.imu_on = SAMPLING, True
        self.health: tuple[int, ...] = ()
        self.sent = {"points": 0, "imu": 0, "push": 0, "search": 0}
        self._ranges, self._found = ranges, found
        self._data_type, self._time_type, self._first_count = data_type, time_type, first_count
        self._points, self._imu, self._slow = StreamTick(points_per_s / DOTS), StreamTick(200), StreamTick(1)
        self._interval_ns = round((DOTS - 1) * SECOND_NS / points_per_s)
        self._tile_first, self._tile = 0, np.zeros(0)

    def due(self, uptime_ns: int) -> list[Outgoing]:
        timed = [(time, self._points_packet(number, time)) for number, time in self._points.due(uptime_ns)]
        timed += [(time, self._imu_packet(number, time)) for number, time in self._imu.due(uptime_ns)]
        for number, time in self._slow.due(uptime_ns):
            timed += [(time, self._discovery(number)), (time, self._push(number))]
        outgoing = [datagram for _, datagram in sorted(timed, key=lambda pair: pair[0]) if self._is_sent(datagram)]
        for datagram in outgoing:
            self.sent[datagram.channel] += 1
        return outgoing

    def set_data_type(self, data_type: DataType) -> None:
        self._data_type, self._tile = data_type, np.zeros(0)

    def values(self) -> dict[int, bytes]:
        """The read-only keys as they are now."""
        return {
            Key.SERIAL: self._found.serial.encode("ascii").ljust(16, b"\0"),
            Key.PRODUCT: b"emulated Mid-360".ljust(64, b"\0"),
            Key.STATE: bytes([self.work_state]),
            Key.CORE_TEMPERATURE: struct.pack("<i", 4525),
            Key.DIAGNOSIS: struct.pack("<H", 0),
            Key.FIRMWARE_TYPE: b"\x01",
            Key.HMS: struct.pack("<8I", *self.health, *[0] * (8 - len(self.health))),
        }

    def _is_sent(self, outgoing: Outgoing) -> bool:
        """An idle lidar keeps its search and push messages and stops measuring."""
        measuring = self.work_state == SAMPLING
        return {"points": measuring, "imu": measuring and self.imu_on}.get(outgoing.channel, True)

    def _points_packet(self, number: int, time_ns: int) -> Outgoing:
        if not len(self._tile) or not self._tile_first <= number < self._tile_first + TILE:
            self._tile_first, self._tile = number, self._scan(number, time_ns)
        start = (number - self._tile_first) * DOTS
        return Outgoing(
            "points",
            encode_packet(
                self._data_type,
                self._tile[start : start + DOTS].tobytes(),
                udp_cnt=self._first_count + number,
                stamp_ns=time_ns,
                interval_ns=self._interval_ns,
                time_type=self._time_type,
            ),
        )

    def _scan(self, number: int, time_ns: int) -> Array:
        rays = directions(number * DOTS, TILE * DOTS)
        ranges = np.asarray(self._ranges(rays, time_ns), dtype=float)
        ranges = np.where(np.isfinite(ranges), ranges, 0.0)
        reflectivity = np.clip(200 - 10 * ranges, 0, 255).astype(np.uint8)
        return encode_records(self._data_type, rays * ranges[:, None], reflectivity, np.zeros(len(rays), np.uint8))

    def _imu_packet(self, number: int, time_ns: int) -> Outgoing:
        record = encode_imu_record(np.zeros(3), GRAVITY_UP)
        kwargs = {"udp_cnt": number, "stamp_ns": time_ns}
        return Outgoing("imu", encode_packet(DataType.IMU, record, time_type=self._time_type, **kwargs))

    def _discovery(self, number: int) -> Outgoing:
        return Outgoing("search", control_wire.encode(control_wire.search_ack(number, self._found)))

    def _push(self, number: int) -> Outgoing:
        return Outgoing("push", control_wire.encode(control_wire.push_request(number, self.values())))
