"""The clocks: wall time that never runs backwards while we run, and one whose time passes only when somebody sleeps."""

from __future__ import annotations

import heapq
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field


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

        Two clocks are read: where the thread is interrupted in between, a small step shows that did not happen.
        """
        return (self._wall_ns() - self.now_ns()) / 1e9

    def sleep(self, seconds: float) -> None:
        time.sleep(max(seconds, 0.0))


@dataclass(order=True)
class _Timer:
    """A periodic callback. Ordered by due time, then by the order of registration."""

    due_ns: int
    order: int
    period_ns: int = field(compare=False)
    callback: Callable[[], None] = field(compare=False)
    stopped: bool = field(default=False, compare=False)


class SimClock:
    """The Clock port, simulated. Sleeping runs every callback that falls due meanwhile, in order of due time.

    Thread-safe: sleepers take turns, so two threads sleeping one second each let two seconds pass. `now_ns` never
    waits. A callback sees its own due time as now, may register further callbacks, and must not sleep. What a callback
    raises comes out of the `sleep` that ran it.
    """

    def __init__(self, start_ns: int) -> None:
        self._now_ns = start_ns
        self._timers: list[_Timer] = []
        self._registered = 0
        self._heap_lock = threading.Lock()
        self._driving = threading.Lock()
        self._driver: int | None = None

    def now_ns(self) -> int:
        """Nanoseconds since the epoch."""
        return self._now_ns

    def every(self, period_s: float, callback: Callable[[], None]) -> Callable[[], None]:
        """Call `callback` each `period_s`, the first time one period from now. Returns the function that ends it."""
        period_ns = round(period_s * 1e9)
        if period_ns <= 0:
            raise ValueError(f"A period must be greater than 0 s, got {period_s}.")
        with self._heap_lock:
            timer = _Timer(self._now_ns + period_ns, self._registered, period_ns, callback)
            self._registered += 1
            heapq.heappush(self._timers, timer)

        def stop() -> None:
            timer.stopped = True

        return stop

    def sleep(self, seconds: float) -> None:
        """Let that much time pass."""
        if self._driver == threading.get_ident():
            raise RuntimeError("A callback of SimClock must not sleep: it already runs inside a sleep.")
        with self._driving:
            self._driver = threading.get_ident()
            try:
                self._run_until(self._now_ns + max(round(seconds * 1e9), 0))
            finally:
                self._driver = None

    def _run_until(self, end_ns: int) -> None:
        while timer := self._pop_due(end_ns):
            self._now_ns = timer.due_ns
            try:
                timer.callback()
            finally:
                timer.due_ns += timer.period_ns
                with self._heap_lock:
                    heapq.heappush(self._timers, timer)
        self._now_ns = end_ns

    def _pop_due(self, end_ns: int) -> _Timer | None:
        with self._heap_lock:
            while self._timers and (self._timers[0].stopped or self._timers[0].due_ns <= end_ns):
                timer = heapq.heappop(self._timers)
                if not timer.stopped:
                    return timer
        return None
