"""A recording's time: what came before the clock's now, its newest value or all since the last call."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Generic, TypeVar

from drivers.ports import Clock, StaleData

Value = TypeVar("Value")


class TimeLine:
    """The recording's time at the clock's now, and ages by it."""

    def __init__(self, clock: Clock, offset_ns: int) -> None:
        self._clock, self.offset_ns = clock, offset_ns

    def now_ns(self) -> int:
        return self._clock.now_ns() - self.offset_ns

    def fresh(self, what: str, found: tuple[int, Value] | None, max_age_s: float) -> tuple[int, Value]:
        """What was found, with its stamp on the clock's time line; raises StaleData."""
        if found is None:
            raise StaleData(f"{what}: the recording has none yet.")
        stamp_ns, value = found
        age_s = (self.now_ns() - stamp_ns) / 1e9
        if age_s > max_age_s:
            raise StaleData(f"{what}: the recording's newest is {age_s:.2f} s old, more than {max_age_s:g} s.")
        return stamp_ns + self.offset_ns, value


class NewestValue(Generic[Value]):
    """The newest of a stream of (stamp_ns, value) at a time that only grows. Thread-safe.

    Holds two values, and once somebody takes: what came since the last `take`.
    """

    def __init__(self, stream: Iterator[tuple[int, Value]]) -> None:
        self._stream, self._lock = stream, threading.Lock()
        self._now: tuple[int, Value] | None = None
        self._ahead = next(stream, None)
        self._untaken: list[tuple[int, Value]] | None = None

    def at(self, now_ns: int) -> tuple[int, Value] | None:
        with self._lock:
            self._go_to(now_ns)
            return self._now

    def take(self, what: str, now_ns: int) -> list[tuple[int, Value]]:
        """All since the last call, at first all so far; raises StaleData once the recording is over."""
        with self._lock:
            if self._untaken is None:
                self._untaken = [] if self._now is None else [self._now]
            self._go_to(now_ns)
            taken, self._untaken = self._untaken, []
        if not taken and self._ahead is None:
            raise StaleData(f"{what}: the recording is over.")
        return taken

    def _go_to(self, now_ns: int) -> None:
        while self._ahead is not None and self._ahead[0] <= now_ns:
            self._now, self._ahead = self._ahead, next(self._stream, None)
            if self._untaken is not None:
                self._untaken.append(self._now)
