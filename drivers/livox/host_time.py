"""The lidar's time in this machine's time, without trusting either clock's zero."""

from __future__ import annotations

WINDOW_NS = 5_000_000_000  # how long a smallest delay counts; at 50 ppm the clocks drift apart by 0.25 ms meanwhile
BACK_NS = 1_000_000  # stamps of packets in order never go back; by more than this, which is rounding, a clock was set
AHEAD_NS = 50_000_000  # no packet is faster than the fastest by so much: the lidar's clock was set ahead


class HostTime:
    """host = device + offset, where offset is the smallest (arrival - device) of the last 5 to 10 s.

    Network and scheduling only ever add delay, so the smallest one is the closest to the truth. The same rule serves
    uptime, PTP (whose zero may be TAI or the master's own) and GPS stamps. However late packets come (a receiver that
    stood still reads them all at once), they stay late: a larger offset is believed only when nothing smaller came for
    a whole window, or when the device's clock was set (it restarted, found or lost its master, left TAI for UTC). One
    for each stream: each has its own socket, so one may be read long after the other.
    """

    def __init__(self) -> None:
        self._now: int | None = None
        self._before = 0
        self._since_ns = 0
        self._newest = 0  # device time
        self._source: int | None = None

    @property
    def offset_ns(self) -> int | None:
        """None before the first packet."""
        return None if self._now is None else min(self._now, self._before)

    @property
    def newest(self) -> tuple[int | None, int]:
        """(whose clock, the latest device time of it), None before the first packet."""
        return self._source, self._newest

    def observe(self, device_ns: int, arrival_ns: int, *, source: int = 0) -> bool:
        """Take one packet, in the order of sending; whether its clock was set since the last. source: whose clock."""
        offset, best = arrival_ns - device_ns, self.offset_ns
        if best is None:
            began = was_set = True
        else:
            was_set = source != self._source or device_ns < self._newest - BACK_NS or offset < best - AHEAD_NS
            began = False
        if was_set:
            self._now = self._before = offset
            self._since_ns, self._newest, self._source = arrival_ns, device_ns, source
        elif arrival_ns - self._since_ns > WINDOW_NS:
            self._before, self._now, self._since_ns = self._now or offset, offset, arrival_ns
        else:
            self._now = min(self._now or offset, offset)
        self._newest = max(self._newest, device_ns)
        return was_set and not began

    def to_host(self, device_ns: int) -> int:
        """Raises ValueError before the first observation."""
        offset = self.offset_ns
        if offset is None:
            raise ValueError("No packet has arrived yet: the lidar's clock is unknown.")
        return device_ns + offset
