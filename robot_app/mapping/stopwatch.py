"""Where the time of a mapping goes: seconds and frames a second of every stage, also of those that run side by side."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from threading import Lock


class Stopwatch:
    """`with clock("read"):` from any thread. `seconds` are of work; with stages side by side their sum is longer than
    the wall's."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self._times: dict[str, int] = defaultdict(int)
        self._workers: Mapping[str, int] = {}
        self._before: dict[str, tuple[float, int]] = {}
        self._lock = Lock()

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self.add(stage, time.perf_counter() - start)

    def add(self, stage: str, seconds: float) -> None:
        """Once more, as somebody else measured it."""
        with self._lock:
            self.seconds[stage] += seconds
            self._times[stage] += 1

    def watch(self, workers: Mapping[str, int]) -> None:
        """`rates` begins anew, for these stages; each with how many frames it has in hand at once."""
        with self._lock:
            self._workers = workers
            self._before = {stage: (self.seconds[stage], self._times[stage]) for stage in workers}

    def rates(self) -> dict[str, float]:
        """Frames a second that each stage could do were it never waiting; the slowest sets the pace."""
        rates = {}
        with self._lock:
            for stage, workers in self._workers.items():
                seconds, times = self._before[stage]
                if self.seconds[stage] > seconds:
                    rates[stage] = workers * (self._times[stage] - times) / (self.seconds[stage] - seconds)
        return rates
