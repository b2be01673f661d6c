"""Asking again, within bounds: back-off, what the other end asked us to wait, and an end to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock
from typing import Protocol, TypeVar

Answer = TypeVar("Answer")
NAP_S = 1.0  # the longest sleep between two looks at whether we were told to stop


class RetryClock(Protocol):
    """The part of the Clock port that is needed here."""

    def now_ns(self) -> int: ...

    def sleep(self, seconds: float) -> None: ...


class TransientFailure(RuntimeError):
    """Worth another try. after_s: how long the other end asked us to wait."""

    def __init__(self, message: str, after_s: float = 0.0) -> None:
        super().__init__(message)
        self.after_s = after_s


class RetryStopped(RuntimeError):
    """We were told to stop while we waited."""


@dataclass(frozen=True)
class RetryPolicy:
    """total_s: from the first failure of a question to the last try."""

    total_s: float
    first_wait_s: float = 0.5
    longest_wait_s: float = 15.0


class Outage:
    """One voice for all the workers that meet the same trouble: it began, it is over."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell, self._lock = tell, Lock()
        self._since_ns: int | None = None

    def began(self, now_ns: int, sentence: str) -> None:
        with self._lock:
            if self._since_ns is None:
                self._since_ns = now_ns
                self._tell(sentence)

    def ended(self, now_ns: int) -> None:
        with self._lock:
            if self._since_ns is not None:
                self._tell(f"It answers again after {(now_ns - self._since_ns) / 1e9:.0f} s.")
                self._since_ns = None


def patiently(
    ask: Callable[[], Answer],
    patience: RetryPolicy,
    clock: RetryClock,
    *,
    outage: Outage,
    stopped: Callable[[], bool] = lambda: False,
) -> Answer:
    """The answer, however many tries it took. Raises the last TransientFailure when patience ends, and RetryStopped."""
    wait_s, first_ns = patience.first_wait_s, None
    while True:
        try:
            answer = ask()
        except TransientFailure as trouble:
            now_ns = clock.now_ns()
            first_ns = now_ns if first_ns is None else first_ns
            pause_s = max(wait_s, trouble.after_s)
            if (now_ns - first_ns) / 1e9 + pause_s > patience.total_s:
                raise
            outage.began(now_ns, f"{trouble} Trying again for up to {patience.total_s:.0f} s.")
            _sleep(pause_s, clock, stopped)
            wait_s = min(2 * wait_s, patience.longest_wait_s)
        else:
            outage.ended(clock.now_ns())
            return answer


def _sleep(seconds: float, clock: RetryClock, stopped: Callable[[], bool]) -> None:
    while seconds > 0:
        if stopped():
            raise RetryStopped("Stopped while waiting.")
        clock.sleep(min(seconds, NAP_S))
        seconds -= NAP_S


class RateLimiter:
    """At most so many starts a minute, evenly spaced; None = no limit. Shared by threads."""

    def __init__(self, per_minute: float | None, clock: RetryClock) -> None:
        self._interval_ns = 0 if per_minute is None else int(60e9 / per_minute)
        self._clock, self._lock, self._next_ns = clock, Lock(), 0

    def wait_turn(self) -> None:
        with self._lock:
            now_ns = self._clock.now_ns()
            turn_ns = max(now_ns, self._next_ns)
            self._next_ns = turn_ns + self._interval_ns
        if turn_ns > now_ns:
            self._clock.sleep((turn_ns - now_ns) / 1e9)
