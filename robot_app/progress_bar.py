"""How far a long job is, as a bar with rate and time left."""

from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, ProgressColumn, Task, TaskID, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.table import Column
from rich.text import Text

from logs.structured import neutralise
from robot_app.progress_lines import stage_rates


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
