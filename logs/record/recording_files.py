"""The files of one recording: `walk.mcap`, `walk_001.mcap` ..., and `walk.events.jsonl`; none is ever overwritten."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from logs.mcap_io.file import McapFile, require_free


def require_unused(path: Path, *, rotated: bool) -> None:
    """Raises FileExistsError by the name of what an earlier recording of that name left, or OSError without a folder.

    rotated: the recording may go on in further files, whose names must be free too.
    """
    require_free(path, McapFile(path).partial)
    if events_of(path).exists():
        raise FileExistsError(
            f"{events_of(path)} exists: the events of an earlier recording of that name. "
            "Move it away too, or name another file"
        )
    if rotated and (taken := sorted(_later_files(path))):
        raise FileExistsError(
            f"{taken[0]} exists, and this recording would go on under such names: move it away, or name another file"
        )


def events_of(path: Path) -> Path:
    """Where a recording's events are written."""
    return path.with_suffix(".events.jsonl")


def next_file(path: Path, number: int) -> McapFile:
    """Open a recording's next file; a number that somebody else took meanwhile is passed over."""
    while True:
        try:
            return McapFile(path.with_name(f"{path.stem}_{number:03d}{path.suffix}")).open()
        except FileExistsError:
            number += 1


def _later_files(path: Path) -> Iterator[Path]:
    """Whole or unfinished ones, of whatever recording that began as `path`."""
    name = re.compile(rf"{re.escape(path.stem)}_\d{{3,}}{re.escape(path.suffix)}(\.partial)?")
    return (each for each in path.parent.iterdir() if name.fullmatch(each.name))
