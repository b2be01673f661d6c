"""The rows of a .belief file for its surroundings: tables that files from before do not have, and their own seal.

The seal covers every row but the images', which each carry a hash that is checked when they are read.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

from openbelief.arrays import Array
from openbelief.documents import from_json
from openbelief.observation import Intrinsics
from openbelief.surroundings import CameraView, StoreyMap, Surroundings, ViewImages
from openbelief.traversability import OccupancyGrid

SCHEMA = """
CREATE TABLE IF NOT EXISTS views (recording TEXT NOT NULL, stamp_ns INTEGER NOT NULL, pose BLOB NOT NULL,
    camera TEXT NOT NULL, images_sha256 BLOB NOT NULL, PRIMARY KEY (recording, stamp_ns));
CREATE TABLE IF NOT EXISTS view_images (recording TEXT NOT NULL, stamp_ns INTEGER NOT NULL, depth BLOB NOT NULL,
    picture BLOB NOT NULL, PRIMARY KEY (recording, stamp_ns));
CREATE TABLE IF NOT EXISTS maps (recording TEXT NOT NULL, height_m REAL NOT NULL, stamp_ns INTEGER NOT NULL,
    resolution_m REAL NOT NULL, x REAL NOT NULL, y REAL NOT NULL, rows INTEGER NOT NULL, columns INTEGER NOT NULL,
    cells BLOB NOT NULL, PRIMARY KEY (recording, height_m));
"""
VIEWS = "SELECT recording, stamp_ns, pose, camera, images_sha256 FROM views NOT INDEXED ORDER BY recording, stamp_ns"
MAPS = "SELECT * FROM maps NOT INDEXED ORDER BY recording, height_m"
IMAGES = "SELECT depth, picture FROM view_images WHERE recording = ? AND stamp_ns = ?"
CAMERA_BYTES_MAX = 1000
MAX_CELLS = 1 << 28


class SurroundingsDamaged(ValueError):
    """What is read is not what was written."""


def has_surroundings(db: sqlite3.Connection) -> bool:
    """False for a file from before there were any."""
    names = {name for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    return {"views", "view_images", "maps"} <= names


def insert_view(db: sqlite3.Connection, view: CameraView, images: ViewImages) -> None:
    c = view.intrinsics
    camera = json.dumps([c.width, c.height, c.fx, c.fy, c.cx, c.cy, *c.distortion])
    pose = np.ascontiguousarray(view.T_map_camera, dtype="<f8").tobytes()
    db.execute("INSERT INTO views VALUES (?, ?, ?, ?, ?)", (*_key(view.key), pose, camera, _images_hash(images)))
    db.execute("INSERT INTO view_images VALUES (?, ?, ?, ?)", (*_key(view.key), images.depth_png, images.picture_jpeg))


def insert_map(db: sqlite3.Connection, one: StoreyMap) -> None:
    """The recording's map of that height; one that is there already is replaced."""
    grid = one.grid
    cells = zlib.compress(np.ascontiguousarray(grid.cells, dtype=np.int8).tobytes())
    where = (float(grid.resolution_m), *(float(n) for n in grid.origin_xy), *(int(n) for n in grid.cells.shape))
    row = (one.recording, float(one.height_m), int(grid.stamp_ns), *where, cells)
    db.execute(f"INSERT OR REPLACE INTO maps VALUES ({'?, ' * 8}?)", row)


def insert_all(db: sqlite3.Connection, surroundings: Surroundings) -> None:
    """Every view with its images, and every map."""
    for view in surroundings.views:
        insert_view(db, view, surroundings.images(view.key))
    for one in surroundings.maps:
        insert_map(db, one)


def poses(db: sqlite3.Connection, recording: str) -> list[tuple[int, Array]]:
    """(stamp_ns, (4, 4) T_map_camera) of every view of a recording."""
    rows = db.execute("SELECT stamp_ns, pose FROM views WHERE recording = ?", (recording,))
    return [(stamp_ns, np.frombuffer(pose, dtype="<f8").reshape(4, 4)) for stamp_ns, pose in rows]


def read_surroundings(db: sqlite3.Connection, images: Callable[[tuple[str, int]], ViewImages]) -> Surroundings:
    """Views and maps; `images` reads a view's own. Raises ValueError on rows that are none."""
    if not has_surroundings(db):
        return Surroundings()
    views = tuple(_view(*row[:4]) for row in db.execute(VIEWS))
    return Surroundings(views, tuple(_map(row) for row in db.execute(MAPS)), images)


def read_images(db: sqlite3.Connection, key: tuple[str, int]) -> ViewImages:
    """Depth and picture of one view. Raises SurroundingsDamaged where they are not what its row says."""
    row = db.execute(IMAGES, key).fetchone()
    sha = db.execute("SELECT images_sha256 FROM views WHERE recording = ? AND stamp_ns = ?", key).fetchone()
    if row is None or sha is None:
        raise SurroundingsDamaged(f"the images of frame {key[1]} of {key[0]!r} are missing")
    images = ViewImages(*row)
    if _images_hash(images) != sha[0]:
        raise SurroundingsDamaged(f"the images of frame {key[1]} of {key[0]!r} are not what was written")
    return images


def seal_surroundings(db: sqlite3.Connection) -> str:
    """Hex sha256 over every view's and map's row; the images are covered by their hashes."""
    sha = hashlib.sha256()
    for query in (VIEWS, MAPS):
        for row in db.execute(query):
            for value in row:
                data = value if isinstance(value, bytes) else repr(value).encode()
                sha.update(f"{type(value).__name__} {len(data)} ".encode() + data)
    return sha.hexdigest()


def _key(key: tuple[str, int]) -> tuple[str, int]:
    return key[0], int(key[1])


def _images_hash(images: ViewImages) -> bytes:
    depth, picture = images.depth_png, images.picture_jpeg
    return hashlib.sha256(len(depth).to_bytes(8, "little") + depth + picture).digest()


def _view(recording: str, stamp_ns: int, pose: bytes, camera: str) -> CameraView:
    width, height, fx, fy, cx, cy, *distortion = from_json(camera, max_bytes=CAMERA_BYTES_MAX)
    T_map_camera = np.frombuffer(pose, dtype="<f8").reshape(4, 4)
    intrinsics = Intrinsics(width, height, fx, fy, cx, cy, tuple(distortion))
    return CameraView(recording, stamp_ns, T_map_camera, intrinsics)


def _map(row: tuple[Any, ...]) -> StoreyMap:
    recording, height_m, stamp_ns, resolution_m, x, y, rows, columns, packed = row
    if not 0 < rows * columns <= MAX_CELLS:
        raise ValueError(f"a map of {rows} x {columns} cells")
    unpack = zlib.decompressobj()
    cells = np.frombuffer(unpack.decompress(packed, rows * columns + 1), np.int8).reshape(rows, columns)
    return StoreyMap(recording, OccupancyGrid(cells, resolution_m, (x, y), stamp_ns), height_m)
