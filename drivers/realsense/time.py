"""The camera's stamps in our clock."""

from __future__ import annotations

import time
from collections.abc import Callable

from drivers.ports import Clock

STEP_NS = 5_000_000  # a smaller change of the wall clock's offset is our own reading's error
TIGHT_NS = 1_000_000  # a reading that took longer was interrupted
WINDOW_NS = 5_000_000_000  # at 50 ppm two clocks drift apart by 0.25 ms meanwhile


class WallTime:
    """This machine's wall clock, of global_time and system_time stamps, in ours, which does not follow its steps."""

    def __init__(self, clock: Clock, wall_ns: Callable[[], int] = time.time_ns) -> None:
        self._clock, self._wall_ns = clock, wall_ns
        self._offset: int | None = None

    def to_ours(self, wall_ns: int) -> int:
        before, wall, after = self._clock.now_ns(), self._wall_ns(), self._clock.now_ns()
        offset = before - wall
        if self._offset is None or (after - before <= TIGHT_NS and abs(offset - self._offset) > STEP_NS):
            self._offset = offset
        return wall_ns + self._offset


class DeviceTime:
    """The device's own clock, of hardware_clock stamps, in ours.

    ours = theirs + offset, offset = the smallest (arrival - theirs) of the last 5 to 10 s.

    Delay only ever adds, so the smallest is the closest. A message that comes late, however late, stays late: a larger
    offset is believed only when nothing smaller came for a whole window. One of these lives as long as one connection.
    """

    def __init__(self) -> None:
        self._offset: int | None = None
        self._before = self._since_ns = 0

    def observe(self, theirs_ns: int, arrival_ns: int) -> None:
        """theirs_ns: when it was sent, by their clock."""
        offset = arrival_ns - theirs_ns
        if self._offset is None:
            self._offset, self._before, self._since_ns = offset, offset, arrival_ns
        elif arrival_ns - self._since_ns > WINDOW_NS:
            self._before, self._offset, self._since_ns = self._offset, offset, arrival_ns
        else:
            self._offset = min(self._offset, offset)

    def to_ours(self, theirs_ns: int) -> int:
        """Raises ValueError before the first observation."""
        if self._offset is None:
            raise ValueError("Nothing has arrived yet: the camera's clock is unknown.")
        return theirs_ns + min(self._offset, self._before)
