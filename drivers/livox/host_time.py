"""The lidar's time in this machine's time, without trusting either clock's zero."""

from __future__ import annotations

WINDOW_NS = 5_000_000_000  # how long a smallest delay counts; at 50 ppm the clocks part 0.25 ms in it
STEP_NS = 1_000_000_000  # a larger change is a lidar that restarted or took a new time source


class HostTime:
    """host = device + offset, where offset is the smallest (arrival - device) of the last 5 to 10 s.

    Network and scheduling only ever add delay, so the smallest one is the closest to the truth. The same rule serves
    uptime, PTP (whose zero may be TAI or the master's own) and GPS stamps.
    """

    def __init__(self) -> None:
        self._now: int | None = None
        self._before = 0
        self._since_ns = 0

    @property
    def offset_ns(self) -> int | None:
        """None before the first packet."""
        return None if self._now is None else min(self._now, self._before)

    def observe(self, device_ns: int, arrival_ns: int) -> None:
        offset = arrival_ns - device_ns
        if self._now is None or abs(offset - min(self._now, self._before)) > STEP_NS:
            self._now = self._before = offset
            self._since_ns = arrival_ns
        elif arrival_ns - self._since_ns > WINDOW_NS:
            self._before, self._now, self._since_ns = self._now, offset, arrival_ns
        elif offset < self._now:
            self._now = offset

    def to_host(self, device_ns: int) -> int:
        """Raises ValueError before the first observation."""
        offset = self.offset_ns
        if offset is None:
            raise ValueError("No packet has arrived yet: the lidar's clock is unknown.")
        return device_ns + offset
