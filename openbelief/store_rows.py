"""The rows of a .belief file: its schema, an observation as a row and back, and the seals over them."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterable
from typing import Any

import numpy as np

from openbelief.arrays import Array
from openbelief.columns import MANIFEST
from openbelief.documents import from_json
from openbelief.observation import Observation, Provenance
from openbelief.run_lengths import Rle

NUMBERS_BYTES_MAX = 1000  # of a box or a size
SCHEMA = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE frames (recording TEXT NOT NULL, stamp_ns INTEGER NOT NULL, skipped TEXT,
    PRIMARY KEY (recording, stamp_ns));
CREATE TABLE observations (
    id INTEGER PRIMARY KEY, recording TEXT NOT NULL, frame INTEGER NOT NULL, mask INTEGER NOT NULL,
    phrase TEXT, confidence REAL NOT NULL, points BLOB NOT NULL, feature BLOB NOT NULL,
    stamp_ns INTEGER, bbox TEXT, rle_size TEXT, rle_counts BLOB, crop_jpeg BLOB);
"""
COLUMNS = "recording, frame, mask, phrase, confidence, points, feature, stamp_ns, bbox, rle_size, rle_counts, crop_jpeg"
FRAMES = "SELECT recording, stamp_ns, skipped FROM frames NOT INDEXED ORDER BY recording, stamp_ns"


def to_row(o: Observation) -> tuple[Any, ...]:
    """The values of COLUMNS, as SQLite gives them back: what is nearly a number, a text or bytes is made one."""
    source, phrase = o.provenance, None if o.phrase is None else str(o.phrase)
    said = (str(o.recording), int(o.frame), int(o.mask), phrase, float(o.confidence), blob(o.points), blob(o.feature))
    if source is None:
        return (*said, None, None, None, None, None)
    counts = np.asarray(source.rle["counts"], dtype="<u4").tobytes()
    boxes = (json.dumps([int(n) for n in source.bbox]), json.dumps([int(n) for n in source.rle["size"]]))
    crop = None if source.crop_jpeg is None else bytes(source.crop_jpeg)
    return (*said, int(source.stamp_ns), *boxes, counts, crop)


def from_row(row: tuple[Any, ...]) -> Observation:
    """From the values of COLUMNS; raises ValueError where they make no observation."""
    recording, frame, mask, phrase, confidence, points, feature, stamp_ns, bbox, size, counts, crop = row
    source = None
    if stamp_ns is not None:
        x0, y0, x1, y1 = _whole_numbers(bbox, 4)
        rle: Rle = {"size": _whole_numbers(size, 2), "counts": np.frombuffer(counts, dtype="<u4").tolist()}
        if type(stamp_ns) is not int or type(recording) is not str or not isinstance(crop, bytes | None):
            raise ValueError("an observation's source is none")
        source = Provenance(recording, stamp_ns, (x0, y0, x1, y1), rle, crop)
    return Observation(frame, mask, phrase, confidence, floats(points).reshape(-1, 3), floats(feature), source)


def _whole_numbers(text: str, count: int) -> list[int]:
    numbers = from_json(text, max_bytes=NUMBERS_BYTES_MAX)
    if not isinstance(numbers, list) or len(numbers) != count or not all(type(n) is int for n in numbers):
        raise ValueError(f"{count} whole numbers are needed, not {text!r:.60}")
    return numbers


def blob(array: Array) -> bytes:
    """Little-endian float32, row by row."""
    return np.ascontiguousarray(array, dtype="<f4").tobytes()


def floats(data: bytes) -> Array:
    """The float32 numbers of a blob, read-only."""
    return np.frombuffer(data, dtype="<f4")


def row_digest(row: Iterable[Any]) -> bytes:
    """32 bytes over a row's values and their kinds."""
    sha = hashlib.sha256()
    _hash_row(sha, row)
    return sha.digest()


def seal(db: sqlite3.Connection) -> str:
    """Hex sha256 over every row of `meta` but the seal itself, every frame, and the digest of every column.

    One of the columns holds the digest of every observation's row, so that what is not read need not be hashed. An
    index holds copies of the keys and answers in their stead: NOT INDEXED takes what is read, the rows.
    """
    meta = db.execute("SELECT key, value FROM meta NOT INDEXED WHERE key != 'seal' ORDER BY key").fetchall()
    manifest = [(name, part, shape, digest.hex()) for name, part, shape, digest in db.execute(MANIFEST)]
    said = json.dumps([meta, db.execute(FRAMES).fetchall(), manifest])
    return hashlib.sha256(b"openbelief.seal/2\n" + said.encode()).hexdigest()


def first_seal(db: sqlite3.Connection) -> str:
    """The seal of format 1: hex sha256 over every row of every table but the seal itself."""
    sha = hashlib.sha256()
    for query in (
        "SELECT * FROM meta NOT INDEXED WHERE key != 'seal' ORDER BY key",
        "SELECT * FROM frames NOT INDEXED ORDER BY recording, stamp_ns",
        "SELECT * FROM observations ORDER BY id",
        "SELECT * FROM phrases NOT INDEXED ORDER BY phrase",
    ):
        for row in db.execute(query):
            _hash_row(sha, row)
    return sha.hexdigest()


def _hash_row(sha: Any, row: Iterable[Any]) -> None:
    for value in row:
        data = value if isinstance(value, bytes) else repr(value).encode()
        sha.update(f"{type(value).__name__} {len(data)} ".encode())
        sha.update(data)
