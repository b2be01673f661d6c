"""The real clock: wall time that never runs backwards and ignores steps of the system clock while we run."""

from __future__ import annotations

import time


class SystemClock:
    """Epoch nanoseconds at construction, advanced by the monotonic clock: an NTP step changes nothing."""

    def __init__(self) -> None:
        self._offset_ns = time.time_ns() - time.monotonic_ns()

    def now_ns(self) -> int:
        return time.monotonic_ns() + self._offset_ns

    def sleep(self, seconds: float) -> None:
        time.sleep(max(seconds, 0.0))
