"""Packets to clouds: 10 Hz by the lidar's own time, no-returns and doubtful points taken out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivers.livox.host_time import HostTime
from drivers.livox.wire import DataPacket, TimeType, decode_points
from drivers.ports import LidarCloud
from openbelief.arrays import Array

PERIOD_NS = 100_000_000
MAX_PACKETS = 1000  # of one frame; a MID-360 sends 208. More means that its clock stands still
DOUBTFUL = 0x0F  # tag bits 0-3: glued points, rain, fog, dust; the bits Unitree drops points for


@dataclass(frozen=True)
class LivoxCloud(LidarCloud):
    """One tenth of a second. Arrays: (n,), row i belongs to points[i].

    `stamp_ns` is the first packet's time in this machine's clock, `offset_ns` each point's time after it, `tag` the
    lidar's doubts about it, of which only the upper four bits can be set. The lidar's own stamp and whose clock gave
    it are kept beside. `sequence` counts assembled clouds: a step of two is a cloud that was not taken in time.
    """

    offset_ns: Array
    reflectivity: Array
    tag: Array
    device_stamp_ns: int
    time_type: TimeType
    sequence: int
    packets: int
    no_returns: int
    doubtful: int

    @property
    def end_ns(self) -> int:
        """The last point's time: from here a cloud grows old."""
        return self.stamp_ns + (int(self.offset_ns[-1]) if len(self.offset_ns) else 0)


class FrameAssembler:
    """Gathers packets until one lies a period after the first; bounded by MAX_PACKETS."""

    def __init__(self) -> None:
        self.late = self.overfull = self.cut = 0
        self._start_ns = 0
        self._packets: list[DataPacket] = []

    def add(self, packet: DataPacket) -> list[DataPacket] | None:
        """The packets of a finished frame, when this packet begins the next one."""
        if not self._packets:
            self._begin(packet, packet.stamp_ns)
            return None
        since_ns = packet.stamp_ns - self._start_ns
        if -PERIOD_NS <= since_ns < 0:
            self.late += 1  # the cloud that it belongs to was already given out
            return None
        if 0 <= since_ns < PERIOD_NS and packet.data_type == self._packets[0].data_type:
            self._gather(packet)
            return None
        finished = self._packets
        follows = PERIOD_NS <= since_ns < 2 * PERIOD_NS
        self._begin(packet, self._start_ns + PERIOD_NS if follows else packet.stamp_ns)
        return finished

    def cut_off(self) -> None:
        """The lidar's clock was set: what was gathered is of another time than what comes, and left out."""
        self.cut += len(self._packets)
        self._packets = []

    def _begin(self, packet: DataPacket, start_ns: int) -> None:
        self._packets, self._start_ns = [packet], start_ns

    def _gather(self, packet: DataPacket) -> None:
        self._packets.append(packet)
        if len(self._packets) > MAX_PACKETS:
            self.overfull += 1
            self._packets = []


def cloud_of(packets: Sequence[DataPacket], time: HostTime, *, frame_id: str, sequence: int) -> LivoxCloud:
    """The cloud of one frame's packets, in order of time."""
    packets = sorted(packets, key=lambda packet: packet.stamp_ns)
    points = decode_points(packets)
    returned = points.xyz_m.any(axis=1)
    sure = (points.tag & DOUBTFUL) == 0
    keep = returned & sure
    return LivoxCloud(
        stamp_ns=time.to_host(packets[0].stamp_ns),
        points=np.ascontiguousarray(points.xyz_m[keep]),
        frame_id=frame_id,
        offset_ns=points.offset_ns[keep],
        reflectivity=points.reflectivity[keep],
        tag=points.tag[keep],
        device_stamp_ns=packets[0].stamp_ns,
        time_type=TimeType(packets[0].time_type),
        sequence=sequence,
        packets=len(packets),
        no_returns=int((~returned).sum()),
        doubtful=int((returned & ~sure).sum()),
    )
