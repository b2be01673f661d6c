"""What was lost on the way: the lidar numbers its packets with a 16-bit counter."""

from __future__ import annotations

from drivers.livox.wire import DataPacket

GAP_LIMIT = 1024  # a larger step is a counter that started anew, not a thousand lost packets
LATE_NS = 1_000_000_000  # packets overtake each other by less
LATE_RUN = 32  # more late ones in a row were not overtaken: a lidar that ran for less than a second started anew
REMEMBERED = 256  # packets back that a duplicate is still recognised


class PacketCounter:
    """Counts lost, duplicated and late packets of one stream, whether the counter runs free or restarts."""

    def __init__(self) -> None:
        self.received = self.lost = self.duplicates = self.out_of_order = 0
        self._newest: DataPacket | None = None
        self._late_run = 0
        self._seen: dict[tuple[int, int], None] = {}

    @property
    def newest(self) -> DataPacket | None:
        """The last packet that was not overtaken."""
        return self._newest

    def accept(self, packet: DataPacket) -> bool:
        """False for a packet that came before. gap = (cnt - previous) & 0xFFFF; 1 < gap < 1024: gap - 1 are lost."""
        identity = (packet.stamp_ns, packet.udp_cnt)
        if identity in self._seen:
            self.duplicates += 1
            return False
        self._remember(identity)
        self.received += 1
        newest = self._newest
        if newest is not None and self._is_late(packet, newest) and self._late_run < LATE_RUN:
            self._late_run += 1
            self.out_of_order += 1
            self.lost = max(self.lost - 1, 0)  # it was counted as lost when its successor overtook it
            return True
        self._late_run = 0
        if newest is not None and 1 < (gap := (packet.udp_cnt - newest.udp_cnt) & 0xFFFF) < GAP_LIMIT:
            self.lost += gap - 1
        self._newest = packet
        return True

    @staticmethod
    def _is_late(packet: DataPacket, newest: DataPacket) -> bool:
        """Overtaken by its successors: a little behind in the counter and earlier in the lidar's time, where both are
        of one clock."""
        behind = 0 < (newest.udp_cnt - packet.udp_cnt) & 0xFFFF < GAP_LIMIT
        ahead_ns = newest.stamp_ns - packet.stamp_ns  # by seconds: not overtaken, the lidar started anew
        return behind and (0 < ahead_ns < LATE_NS or packet.time_type != newest.time_type)

    def _remember(self, identity: tuple[int, int]) -> None:
        self._seen[identity] = None
        if len(self._seen) > REMEMBERED:
            del self._seen[next(iter(self._seen))]
