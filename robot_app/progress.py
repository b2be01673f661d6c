"""How far a long job is, on stderr: a bar with rate and time left on a terminal, a line every few seconds elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.text import Text

from logs.structured import neutralise

LINE_EVERY_S = 5.0


def stage_rates(rates: Mapping[str, float]) -> str:
    """ "phrases 2.1/s, segments 8.0/s": slowest first, for it sets the pace."""
    return ", ".join(f"{stage} {rate:.1f}/s" for stage, rate in sorted(rates.items(), key=lambda item: item[1]))


class _Rate(ProgressColumn):
    def render(self, task: Task) -> Text:
        return Text(f"{task.speed:.1f} frames/s" if task.speed else "")


class BarProgress:
    """A bar that a person can watch."""

    def __init__(self) -> None:
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), _Rate(), TimeRemainingColumn())
        self._bar = Bar(*columns, console=Console(stderr=True))
        self._tasks: dict[str, int] = {}

    def frames(self, recording: str, done: int, total: int, rates: Mapping[str, float] | None = None) -> None:
        if recording not in self._tasks:
            self._tasks[recording] = self._bar.add_task(recording, total=total or None, completed=done)
        said = f"{recording} ({stage_rates(rates)})" if rates else recording
        self._bar.update(self._tasks[recording], completed=done, description=said)  # type: ignore[arg-type]  # a NewType of int

    def step(self, sentence: str) -> None:
        self._bar.console.print(f"{neutralise(sentence)} ...", highlight=False, markup=False)

    def __enter__(self) -> BarProgress:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()


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


def progress() -> BarProgress | LineProgress:
    """The one that suits this stderr."""
    return BarProgress() if sys.stderr.isatty() else LineProgress()
