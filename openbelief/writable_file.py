"""A .belief file that is written: in WAL mode, one writer, every transaction all or nothing."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

from openbelief import surroundings_rows
from openbelief.columns import SCHEMA as COLUMNS_SCHEMA
from openbelief.file_checks import (
    APPLICATION_ID,
    FORMAT,
    file_format,
    one_line_errors,
    refuse_computed,
    refuse_foreign,
    unwritten,
)
from openbelief.store_rows import SCHEMA, seal


class WritableFile:
    """Its connection is `db`. What the disk refuses is a BeliefFileError."""

    def __init__(self, db: sqlite3.Connection, path: Path) -> None:
        self.db, self.path = db, path

    @classmethod
    def create(cls, path: Path, meta: Mapping[str, Any]) -> Self:
        """Raises FileExistsError where there is one, ValueError where a value of `meta` is not JSON."""
        if path.exists():
            raise FileExistsError(f"{path} exists already: choose another name, or remove it first.")
        rows = [(key, json.dumps(value, allow_nan=False)) for key, value in meta.items()]
        with unwritten(path):
            db = _connect(path)
            db.executescript(
                f"PRAGMA application_id={APPLICATION_ID}; PRAGMA user_version={FORMAT}; "
                f"BEGIN; {SCHEMA} {COLUMNS_SCHEMA} {surroundings_rows.SCHEMA}"
            )
            db.executemany("INSERT INTO meta VALUES (?, ?)", rows)
            db.execute("COMMIT")  # before WAL: the header alone must say whose file this is
            db.execute("PRAGMA journal_mode=WAL")
        return cls(db, path)

    @classmethod
    def resume(cls, path: Path) -> Self:
        """One that is unfinished, or shall hold more."""
        refuse_foreign(path)
        with one_line_errors(path):
            db = _connect(path)
            file_format(db, path)
            refuse_computed(db, path)
            db.execute("PRAGMA journal_mode=WAL")
            db.executescript(COLUMNS_SCHEMA + surroundings_rows.SCHEMA)  # a file from before there were any
            return cls(db, path)

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """What is written in it is in the file when it ends, or nothing of it."""
        with unwritten(self.path):
            self.db.execute("BEGIN IMMEDIATE")
            try:
                yield
                self.db.execute("COMMIT")
            except BaseException:
                if self.db.in_transaction:  # a full disk has ended it already
                    self.db.execute("ROLLBACK")
                raise

    def set_meta(self, key: str, value: Any) -> None:
        self.db.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (key, json.dumps(value, allow_nan=False)))

    def seal(self) -> None:
        self.set_meta("seal", seal(self.db))
        self.db.execute(f"PRAGMA user_version={FORMAT}")

    def unseal(self) -> None:
        """More is coming: the file is no memory until it is sealed again."""
        self.db.execute("DELETE FROM meta WHERE key IN ('content_hash', 'seal')")

    def leave_wal(self) -> None:
        """From here on the one file is all there is: a WAL file copied without its companion is broken."""
        self.db.execute("PRAGMA journal_mode=DELETE")

    def close(self) -> None:
        self.db.close()


def _connect(path: Path) -> sqlite3.Connection:
    db = sqlite3.connect(path, isolation_level=None, timeout=0.2)
    db.execute("PRAGMA locking_mode=EXCLUSIVE")  # a second mapper on the same file is refused
    return db
