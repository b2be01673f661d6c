"""The real clock: wall time that never runs backwards and ignores steps of the system clock while we run."""

from __future__ import annotations

import time
from collections.abc import Callable


class SystemClock:
    """Epoch nanoseconds at construction, advanced by the monotonic clock: an NTP step changes nothing.

    So durations are right whatever happens to the system clock, and stamps are right as long as nobody sets it: who
    stamps data for others looks at `set_by_s` and begins anew, with a new clock, where it was.
    """

    def __init__(
        self,
        wall_ns: Callable[[], int] = time.time_ns,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._wall_ns, self._monotonic_ns = wall_ns, monotonic_ns
        self._offset_ns = wall_ns() - monotonic_ns()

    def now_ns(self) -> int:
        return self._monotonic_ns() + self._offset_ns

    def set_by_s(self) -> float:
        """How far the system clock was set since we began, by NTP, a hand or a suspended machine; ahead is positive.

        An interrupted reading shows a little of it where there is none.
        """
        return (self._wall_ns() - self.now_ns()) / 1e9

    def sleep(self, seconds: float) -> None:
        time.sleep(max(seconds, 0.0))
