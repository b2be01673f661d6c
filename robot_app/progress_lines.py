"""How far a long job is, as lines for a log file."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from types import TracebackType

from logs.structured import neutralise

LINE_EVERY_S = 5.0


def stage_rates(rates: Mapping[str, float]) -> str:
    """ "phrases 2.1/s, segments 8.0/s": slowest first, for it sets the pace."""
    return ", ".join(f"{stage} {rate:.1f}/s" for stage, rate in sorted(rates.items(), key=lambda item: item[1]))


class LineProgress:
    """Lines for a log file."""

    def __init__(self) -> None:
        self._next_s = 0.0
        self._start: dict[str, tuple[float, int]] = {}

    def frames(self, recording: str, done: int, total: int, rates: Mapping[str, float] | None = None) -> None:
        now_s = time.monotonic()
        start_s, first = self._start.setdefault(recording, (now_s, done))
        if now_s < self._next_s and done != total:
            return
        self._next_s = now_s + LINE_EVERY_S
        rate = (done - first) / (now_s - start_s) if now_s > start_s else 0.0
        left = f", {(total - done) / rate:.0f} s left" if rate and total else ""
        speed = f", {rate:.1f} frames/s" if rate else ""
        stages = f" ({stage_rates(rates)})" if rates else ""
        self.step(f"{recording}: {done}{f' of {total}' if total else ''} frames{speed}{left}{stages}")

    def step(self, sentence: str) -> None:
        print(neutralise(sentence), file=sys.stderr, flush=True)

    def __enter__(self) -> LineProgress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing is open."""
