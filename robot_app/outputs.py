"""Files that a verb is asked to write: what is wrong with their names is said before any work."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from robot_app.cli import Failure

# how a file begins -> what it is; no page and no picture is written over one
KEPT = {
    b"SQLite format 3\0": "a memory or another database",
    b"\x89MCAP0\r\n": "a recording",
    b"#ROSBAG V2.0\n": "a recording",
}


def require_writable(path: Path) -> None:
    """Raises Failure where it is a folder, or its folder is not there, or it is a file that cannot be made again."""
    if path.is_dir():
        raise Failure(f"{path} is a folder: name the file to write in it.")
    if not path.parent.is_dir():
        raise Failure(f"The folder {path.parent} does not exist: create it, or write to another.")
    if what := _kept(path):
        raise Failure(f"{path} is {what}, and would be lost: name another file.")


def require_kind(path: Path, option: str, kinds: Sequence[str]) -> None:
    """Raises Failure where the name does not end in a kind that can be drawn."""
    if path.suffix not in kinds:
        raise Failure(f"{option} {path}: the name should end in {' or '.join(kinds)}.")


def require_replaceable(path: Path, read: Iterable[Path]) -> None:
    """What --force may replace. read: what the command reads. Raises Failure on one of these, a recording, a folder."""
    from openbelief.file_checks import is_memory

    if path.is_dir():
        raise Failure(f"{path} is a folder: name the file to write in it.")
    what = None if path.is_file() and is_memory(path) else _kept(path)
    if path.exists() and any(each.exists() and path.samefile(each) for each in read):
        what = "what this command reads"
    if path.exists() and not path.is_file():
        what = "a pipe or a device"
    if what:
        raise Failure(f"{path} is {what}, and would be lost: choose another -o.")


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """What the disk refuses becomes one Failure that names the file."""
    try:
        yield
    except OSError as error:
        raise Failure(f"{path} cannot be written: {error.strerror}.") from error


def _kept(path: Path) -> str | None:
    if not path.is_file():  # nothing, or a pipe or device, which would be waited for
        return None
    with path.open("rb") as file:
        start = file.read(16)
    return next((what for begin, what in KEPT.items() if start.startswith(begin)), None)
