"""How far a long job is, on stderr: a bar with rate and time left on a terminal, a line every few seconds elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, ProgressColumn, Task, TaskID, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.table import Column
from rich.text import Text

from logs.structured import neutralise

LINE_EVERY_S = 5.0


def stage_rates(rates: Mapping[str, float]) -> str:
    """ "phrases 2.1/s, segments 8.0/s": slowest first, for it sets the pace."""
    return ", ".join(f"{stage} {rate:.1f}/s" for stage, rate in sorted(rates.items(), key=lambda item: item[1]))


class _Rate(ProgressColumn):
    def render(self, task: Task) -> Text:
        return Text(f"{task.speed:.1f}/s" if task.speed else "")


def _columns() -> tuple[ProgressColumn, ...]:
    """They fit 80 characters: what is long is the description, and gives way."""
    name = Column(ratio=1, no_wrap=True, overflow="ellipsis")
    fixed = [Column(no_wrap=True) for _ in range(3)]
    return (
        TextColumn("{task.description}", markup=False, table_column=name),
        BarColumn(bar_width=20),
        MofNCompleteColumn(table_column=fixed[0]),
        _Rate(table_column=fixed[1]),
        TimeRemainingColumn(table_column=fixed[2]),
    )


class BarProgress:
    """A bar that a person can watch; what has ended is a line above it."""

    def __init__(self, console: Console | None = None) -> None:
        self._bar = Bar(*_columns(), console=console or Console(stderr=True), expand=True)
        self._tasks: dict[str, TaskID] = {}
        self._ended: set[str] = set()

    def frames(self, recording: str, done: int, total: int, rates: Mapping[str, float] | None = None) -> None:
        if recording in self._ended and done == total:
            return
        self._ended.discard(recording)
        if recording not in self._tasks:
            self._tasks[recording] = self._bar.add_task("", total=total or None, completed=done)
        slowest = f" ({stage_rates(rates).split(', ')[0]})" if rates else ""
        said = f"{neutralise(recording)}{slowest}"
        self._bar.update(self._tasks[recording], completed=done, total=total or None, description=said)
        if total and done == total:
            self._end(recording, total)

    def _end(self, recording: str, total: int) -> None:
        task = self._tasks.pop(recording)
        elapsed_s = next(each.elapsed for each in self._bar.tasks if each.id == task) or 0.0
        self._bar.remove_task(task)
        self._ended.add(recording)
        said = f"{neutralise(recording)}: {total} frames in {elapsed_s:.1f} s"
        self._bar.console.print(said, highlight=False, markup=False)

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
