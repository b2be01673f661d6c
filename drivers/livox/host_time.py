"""The lidar's time in this machine's time, without trusting either clock's zero."""

from __future__ import annotations

WINDOW_NS = 5_000_000_000  # how long a smallest delay counts; at 50 ppm the clocks part 0.25 ms in it
BACK_NS = 1_000_000_000  # packets of one stream overtake each other by less: a larger step back is a new clock


class HostTime:
    """host = device + offset, where offset is the smallest (arrival - device) of the last 5 to 10 s.

    Network and scheduling only ever add delay, so the smallest one is the closest to the truth. The same rule serves
    uptime, PTP (whose zero may be TAI or the master's own) and GPS stamps. However late packets come (a receiver that
    stood still reads them all at once), they stay late: a larger offset is believed only when nothing smaller came for
    a whole window, or when the device's time went back, in one stream: it restarted or took another time source.
    """

    def __init__(self) -> None:
        self._now: int | None = None
        self._before = 0
        self._since_ns = 0
        self._newest: dict[str, int] = {}  # stream -> device time

    @property
    def offset_ns(self) -> int | None:
        """None before the first packet."""
        return None if self._now is None else min(self._now, self._before)

    def observe(self, device_ns: int, arrival_ns: int, stream: str = "points") -> None:
        """stream: each has its own socket, so one may be read long after another."""
        offset, newest = arrival_ns - device_ns, self._newest.get(stream, device_ns)
        if self._now is None or device_ns < newest - BACK_NS:
            self._now = self._before = offset
            self._since_ns, self._newest = arrival_ns, {}
            newest = device_ns
        elif arrival_ns - self._since_ns > WINDOW_NS:
            self._before, self._now, self._since_ns = self._now, offset, arrival_ns
        else:
            self._now = min(self._now, offset)
        self._newest[stream] = max(newest, device_ns)

    def to_host(self, device_ns: int) -> int:
        """Raises ValueError before the first observation."""
        offset = self.offset_ns
        if offset is None:
            raise ValueError("No packet has arrived yet: the lidar's clock is unknown.")
        return device_ns + offset
