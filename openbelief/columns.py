"""Arrays by name, each with its dtype and shape: kept in a file, read and checked when they are asked for."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from typing import NamedTuple

import numpy as np

from openbelief.arrays import Array
from openbelief.documents import from_json
from openbelief.file_checks import VALUE_BYTES_MAX

PART_BYTES = 1 << 28  # SQLite keeps at most 1e9 bytes in one value
SHAPE_BYTES_MAX = 1000
SCHEMA = """
CREATE TABLE IF NOT EXISTS columns (name TEXT NOT NULL, part INTEGER NOT NULL, shape TEXT NOT NULL,
    sha256 BLOB NOT NULL, data BLOB NOT NULL, PRIMARY KEY (name, part));
"""
MANIFEST = "SELECT name, part, shape, sha256 FROM columns NOT INDEXED ORDER BY name, part"
PARTS = "SELECT rowid FROM columns NOT INDEXED WHERE name = ? ORDER BY part"


class Column(NamedTuple):
    """dtype, and the shape in symbols. below: its numbers are rows of what has so many, from `least`; starts: begins of
    runs of what has so many."""

    dtype: str
    shape: tuple[str | int, ...]
    below: str | None = None
    starts: str | None = None
    least: int = 0


class ColumnDamaged(ValueError):
    """What is read is not what was written, or is none of what it should be."""


class SealedColumns(Mapping[str, Array]):
    """The columns of a file. Read-only; each is read once, when it is first asked for, and checked then.

    shapes, digests: by name, as the sealed manifest says. sizes: what the symbols stand for. read: gives the bytes.
    reading: what happens inside may raise ColumnDamaged.
    """

    def __init__(
        self,
        specification: Mapping[str, Column],
        shapes: Mapping[str, tuple[int, ...]],
        digests: Mapping[str, bytes],
        sizes: Mapping[str, int],
        read: Callable[[str], bytes],
        reading: Callable[[], AbstractContextManager[None]],
    ) -> None:
        self._specification, self._shapes, self._digests = specification, shapes, digests
        self._sizes, self._read, self._reading = dict(sizes), read, reading
        self._known: dict[str, Array] = {}
        if missing := sorted(set(specification) - set(shapes)):
            raise ColumnDamaged(f"its column {missing[0]!r} is missing")
        for name, column in specification.items():
            self._check_shape(name, column)

    def __getitem__(self, name: str) -> Array:
        if name not in self._known:
            with self._reading():
                self._known[name] = self._read_checked(name)
        return self._known[name]

    def __contains__(self, name: object) -> bool:
        return name in self._specification

    def __iter__(self) -> Iterator[str]:
        return iter(self._specification)

    def __len__(self) -> int:
        return len(self._specification)

    def unread(self) -> dict[str, bytes]:
        """The digests of the columns that nobody asked for yet."""
        return {name: self._digests[name] for name in self._specification if name not in self._known}

    def _check_shape(self, name: str, column: Column) -> None:
        """Every symbol is one number throughout; the first that uses it says which."""
        shape = self._shapes[name]
        if len(shape) != len(column.shape):
            raise ColumnDamaged(f"its column {name!r} has the shape {shape}")
        for symbol, size in zip(column.shape, shape, strict=True):
            more = 1 if str(symbol).endswith("+1") else 0
            known = symbol if isinstance(symbol, int) else self._sizes.setdefault(symbol[:1], size - more) + more
            if size != known:
                raise ColumnDamaged(f"its column {name!r} has the shape {shape}")

    def _read_checked(self, name: str) -> Array:
        column, shape, data = self._specification[name], self._shapes[name], self._read(name)
        if hashlib.sha256(data).digest() != self._digests[name]:
            raise ColumnDamaged(f"its column {name!r} is not what was written")
        dtype = np.dtype(column.dtype)
        if len(data) != int(np.prod(shape, dtype=object)) * dtype.itemsize:
            raise ColumnDamaged(f"its column {name!r} has another length than its shape")
        array = np.frombuffer(data, dtype).reshape(shape)
        self._check_values(name, column, array)
        return array

    def _check_values(self, name: str, column: Column, array: Array) -> None:
        fits = array.dtype.kind != "f" or bool(np.isfinite(array).all())
        if column.below:
            fits = not array.size or (array.min() >= column.least and array.max() < self._sizes[column.below])
        if column.starts:
            fits = array[0] == 0 and array[-1] == self._sizes[column.starts] and bool((np.diff(array) >= 0).all())
        if not fits:
            raise ColumnDamaged(f"its column {name!r} holds what cannot be")


def write_columns(db: sqlite3.Connection, columns: Mapping[str, Array]) -> None:
    """Columns that are there already are replaced."""
    for name, array in columns.items():
        data, shape = np.ascontiguousarray(array).tobytes(), json.dumps(array.shape)
        db.execute("DELETE FROM columns WHERE name = ?", (name,))
        digest = hashlib.sha256(data).digest()
        for part in range(max(1, -(-len(data) // PART_BYTES))):
            piece = data[part * PART_BYTES : (part + 1) * PART_BYTES]
            db.execute("INSERT INTO columns VALUES (?, ?, ?, ?, ?)", (name, part, shape, digest, piece))


def read_manifest(db: sqlite3.Connection) -> tuple[dict[str, tuple[int, ...]], dict[str, bytes]]:
    """Shapes and digests by name. Raises ColumnDamaged."""
    shapes: dict[str, tuple[int, ...]] = {}
    digests: dict[str, bytes] = {}
    for name, _, shape, digest in db.execute(MANIFEST):
        sizes = from_json(shape, max_bytes=SHAPE_BYTES_MAX)
        if not isinstance(sizes, list) or not all(type(n) is int and 0 <= n < 1 << 40 for n in sizes):
            raise ColumnDamaged(f"its column {name!r} has no shape")
        shapes[name], digests[name] = tuple(sizes), bytes(digest)
    return shapes, digests


def read_data(db: sqlite3.Connection, name: str) -> bytes:
    """A column's bytes, copied once: a SELECT would hold three copies of them. Raises ColumnDamaged."""
    parts = [_read_blob(db, row) for (row,) in db.execute(PARTS, (name,)).fetchall()]
    return parts[0] if len(parts) == 1 else b"".join(parts)


def _read_blob(db: sqlite3.Connection, row: int) -> bytes:
    with db.blobopen("columns", "data", row, readonly=True) as blob:
        if len(blob) > VALUE_BYTES_MAX:
            raise ColumnDamaged("a part of its columns is too big")
        return blob.read()
