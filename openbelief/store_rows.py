"""The rows of a .belief file: its schema, an observation as a row and back, and the seal over all of them."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from typing import Any

import numpy as np

from openbelief.arrays import Array
from openbelief.observation import Observation, Provenance, Rle

SCHEMA = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE frames (recording TEXT NOT NULL, stamp_ns INTEGER NOT NULL, skipped TEXT,
    PRIMARY KEY (recording, stamp_ns));
CREATE TABLE observations (
    id INTEGER PRIMARY KEY, recording TEXT NOT NULL, frame INTEGER NOT NULL, mask INTEGER NOT NULL,
    phrase TEXT, confidence REAL NOT NULL, points BLOB NOT NULL, feature BLOB NOT NULL,
    stamp_ns INTEGER, bbox TEXT, rle_size TEXT, rle_counts BLOB, crop_jpeg BLOB, object INTEGER);
CREATE TABLE phrases (phrase TEXT PRIMARY KEY, embedding BLOB NOT NULL);
"""
COLUMNS = "recording, frame, mask, phrase, confidence, points, feature, stamp_ns, bbox, rle_size, rle_counts, crop_jpeg"


def to_row(o: Observation) -> tuple[Any, ...]:
    """The values of COLUMNS."""
    source = o.provenance
    numbers = (int(o.frame), int(o.mask), o.phrase, float(o.confidence))  # numpy's own would be stored as blobs
    said = (o.recording, *numbers, blob(o.points), blob(o.feature))
    if source is None:
        return (*said, None, None, None, None, None)
    counts = np.asarray(source.rle["counts"], dtype="<u4").tobytes()
    boxes = (json.dumps([int(n) for n in source.bbox]), json.dumps([int(n) for n in source.rle["size"]]))
    return (*said, int(source.stamp_ns), *boxes, counts, source.crop_jpeg)


def from_row(row: tuple[Any, ...]) -> Observation:
    """From the values of COLUMNS; raises ValueError where they make no observation."""
    recording, frame, mask, phrase, confidence, points, feature, stamp_ns, bbox, size, counts, crop = row
    source = None
    if stamp_ns is not None:
        rle: Rle = {"size": json.loads(size), "counts": np.frombuffer(counts, dtype="<u4").tolist()}
        source = Provenance(recording, stamp_ns, tuple(json.loads(bbox)), rle, crop)
    return Observation(frame, mask, phrase, confidence, floats(points).reshape(-1, 3), floats(feature), source)


def blob(array: Array) -> bytes:
    """Little-endian float32, row by row."""
    return np.ascontiguousarray(array, dtype="<f4").tobytes()


def floats(data: bytes) -> Array:
    """The float32 numbers of a blob, read-only."""
    return np.frombuffer(data, dtype="<f4")


def seal(db: sqlite3.Connection) -> str:
    """Hex sha256 over every row of every table but the seal itself, so that a flipped bit is noticed.

    An index holds copies of the keys and answers in their stead: NOT INDEXED takes what `read` reads, the rows.
    """
    sha = hashlib.sha256()
    for query in (
        "SELECT * FROM meta NOT INDEXED WHERE key != 'seal' ORDER BY key",
        "SELECT * FROM frames NOT INDEXED ORDER BY recording, stamp_ns",
        "SELECT * FROM observations ORDER BY id",
        "SELECT * FROM phrases NOT INDEXED ORDER BY phrase",
    ):
        for row in db.execute(query):
            for value in row:
                data = value if isinstance(value, bytes) else repr(value).encode()
                sha.update(f"{type(value).__name__} {len(data)} ".encode() + data)
    return sha.hexdigest()
