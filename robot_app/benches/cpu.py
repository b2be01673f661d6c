"""CPU time of a piece of work, beside a plain yardstick in the same run: a ratio survives a busy or a slow machine."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from typing import Any, TypeVar

from robot_app import arguments

T = TypeVar("T")
count = arguments.whole(1, 1_000_000)  # of things that a bench makes


def cpu_s(work: Callable[[], T], times: int = 1) -> tuple[float, T]:
    """(the least CPU seconds of this process over so many times, what the last one gave)."""
    least = float("inf")
    for _ in range(times):
        began = time.process_time()
        result = work()
        least = min(least, time.process_time() - began)
    return least, result


def peak_mb() -> int:
    """The most memory that this process has held so far."""
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def beside_plain(ours_s: float, plain_s: float | None, equal: bool | None) -> dict[str, Any]:
    """What every row says of its yardstick; None where that was not run."""
    ratio = None if plain_s is None else round(plain_s / ours_s, 1)
    return {"plain_cpu_s": None if plain_s is None else round(plain_s, 4), "ratio": ratio, "equal": equal}


def said(row: dict[str, Any]) -> str:
    """A row's yardstick for a person."""
    if row["ratio"] is None:
        return "plain not run"
    return f"plain {row['plain_cpu_s']:.3g} s, {row['ratio']:g}x, {'equal' if row['equal'] else 'NOT EQUAL'}"
