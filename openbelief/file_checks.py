"""What a .belief file must be before it is believed, and the one line that says what is wrong with it."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from openbelief.phrase import printable

APPLICATION_ID = 0x4F42454C  # "OBEL", in the SQLite header
MAGIC = b"SQLite format 3\0"
FORMAT = 2  # user_version; raised when an older reader would misread. 1: no columns, every row under one seal
FIRST_FORMAT = 1
VALUE_BYTES_MAX = (1 << 28) + (1 << 20)  # of one SQLite value; a longer one is refused before it is read
TABLES = {"meta", "frames", "observations", "phrases", "columns", "views", "view_images", "maps"}
DAMAGE = (sqlite3.Error, ValueError, KeyError, TypeError, OverflowError, IndexError, AttributeError, RecursionError)


class BeliefFileError(ValueError):
    """A .belief file that cannot be used; the message names the cause and the remedy in one line."""


def damaged(path: Path, how: str) -> str:
    return (
        f"{path} is damaged ({printable(how, 200)}): copy it again from its source, or build it again with "
        "`openbelief map`."
    )


def unfinished(path: Path) -> str:
    return f"{path} is an unfinished mapping: run the same `openbelief map` command again, it goes on where it stopped."


@contextmanager
def one_line_errors(path: Path) -> Iterator[None]:
    """Whatever damage breaks the reading (SQLite, JSON, shapes, values) becomes one BeliefFileError."""
    try:
        yield
    except BeliefFileError:
        raise
    except sqlite3.OperationalError as error:
        if "locked" in str(error):
            raise BeliefFileError(f"{path} is being written by another process: wait until it has finished.") from error
        raise BeliefFileError(damaged(path, str(error))) from error
    except DAMAGE as error:
        raise BeliefFileError(damaged(path, str(error) or type(error).__name__)) from error


@contextmanager
def unwritten(path: Path) -> Iterator[None]:
    """What the disk refuses becomes one BeliefFileError."""
    try:
        yield
    except (OSError, sqlite3.Error) as error:
        if isinstance(error, FileExistsError):
            raise
        raise BeliefFileError(f"{path} cannot be written: {error}.") from error


def refuse_foreign(path: Path) -> None:
    """Look at the 100-byte SQLite header before SQLite does: what is it, and is all of it there?"""
    if path.is_dir():
        raise BeliefFileError(f"{path} is a folder, not a memory: name the file that `openbelief map` made in it.")
    if not path.is_file():
        raise BeliefFileError(f"{path} does not exist: build it with `openbelief map`.")
    with path.open("rb") as file:
        header = file.read(100)
    if not header:
        raise BeliefFileError(f"{path} is empty, not an OpenBelief memory: build it again with `openbelief map`.")
    if not header.startswith(MAGIC[: len(header)]) or (
        len(header) == 100 and int.from_bytes(header[68:72]) != APPLICATION_ID
    ):
        raise BeliefFileError(f"{path} is not an OpenBelief memory: give a file made by `openbelief map`.")
    pages = 0 if 2 in header[18:20] else int.from_bytes(header[28:32])  # in WAL mode the count may run ahead
    if len(header) < 100 or path.stat().st_size < pages * int.from_bytes(header[16:18]):
        raise BeliefFileError(damaged(path, f"it is cut short at {path.stat().st_size} bytes"))


def is_memory(path: Path) -> bool:
    """Whether a file begins as a .belief file does, whatever became of the rest of it."""
    with path.open("rb") as file:
        header = file.read(100)
    return header.startswith(MAGIC) and int.from_bytes(header[68:72]) == APPLICATION_ID


def refuse_unfinished(path: Path) -> None:
    with path.open("rb") as file:
        if 2 in file.read(20)[18:20]:  # the header's WAL marks
            raise BeliefFileError(unfinished(path))


def file_format(db: sqlite3.Connection, path: Path) -> int:
    """The format that the file claims. Raises BeliefFileError where this program does not read it."""
    found = int(db.execute("PRAGMA user_version").fetchone()[0])
    if found > FORMAT:
        raise BeliefFileError(
            f"{path} was written by a newer OpenBelief (format {found}; this one reads {FORMAT}): update OpenBelief."
        )
    if found < FIRST_FORMAT:
        raise BeliefFileError(damaged(path, f"it claims format {found}, which never existed"))
    return found


def refuse_computed(db: sqlite3.Connection, path: Path) -> None:
    """Plain tables only: a view, a trigger or a generated column would run what a stranger wrote when it is read."""
    db.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, VALUE_BYTES_MAX)
    db.execute("PRAGMA trusted_schema=OFF")
    for kind, name, sql in db.execute("SELECT type, name, sql FROM sqlite_master"):
        plain = kind == "index" and sql is None  # of a primary key
        plain |= kind == "table" and name in TABLES and str(sql).upper().startswith("CREATE TABLE")
        if not plain:
            raise BeliefFileError(damaged(path, f"it holds a {kind} {name!r}"))
        if kind == "table" and any(row[6] for row in db.execute(f"PRAGMA table_xinfo({name})")):
            raise BeliefFileError(damaged(path, f"its table {name!r} has a computed column"))
