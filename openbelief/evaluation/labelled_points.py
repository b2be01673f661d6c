"""Ground-truth points with a class each: a binary PLY with x, y, z and `label`, and a text file of class names."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from openbelief.arrays import Array

SCALARS = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "<i2",
    "int16": "<i2",
    "ushort": "<u2",
    "uint16": "<u2",
    "int": "<i4",
    "int32": "<i4",
    "uint": "<u4",
    "uint32": "<u4",
    "float": "<f4",
    "float32": "<f4",
    "double": "<f8",
    "float64": "<f8",
}
MAX_HEADER_BYTES = 1 << 16


def read_classes(path: str | os.PathLike[str]) -> list[str]:
    """One class name a line; the line number, from 0, is the class number."""
    names = [line.strip() for line in Path(path).read_text(encoding="utf-8").splitlines()]
    if not any(names):
        raise ValueError(f"{path} names no class.")
    return names


def read_labelled_points(path: str | os.PathLike[str], classes: int) -> tuple[Array, Array]:
    """(n, 3) float64 points, map frame, metres, and (n,) int64 class numbers below `classes`. Raises ValueError."""
    data = Path(path).read_bytes()
    end = data.find(b"end_header\n", 0, MAX_HEADER_BYTES)
    if not data.startswith(b"ply") or end < 0:
        raise ValueError(f"{path} is not a PLY file.")
    count, layout = _vertex_layout(data[:end].decode("ascii", "replace").splitlines(), path)
    body = data[end + len(b"end_header\n") :]
    if len(body) < count * layout.itemsize:
        raise ValueError(f"{path} is cut short: {len(body)} bytes where {count} points need {count * layout.itemsize}.")
    vertices = np.frombuffer(body, layout, count)
    points = np.column_stack([vertices[axis] for axis in "xyz"]).astype(np.float64)
    labels = vertices["label"].astype(np.int64)
    if count == 0 or not np.isfinite(points).all() or labels.min() < 0 or labels.max() >= classes:
        raise ValueError(f"{path} should hold finite points with labels from 0 to {classes - 1}.")
    return points, labels


def _vertex_layout(header: list[str], path: str | os.PathLike[str]) -> tuple[int, np.dtype]:
    """How many vertices, and a vertex as a numpy record; only a vertex element that comes first is read."""
    if "format binary_little_endian 1.0" not in header:
        raise ValueError(f"{path} should be binary_little_endian PLY.")
    elements = [i for i, line in enumerate(header) if line.startswith("element ")]
    if not elements or header[elements[0]].split()[1] != "vertex":
        raise ValueError(f"{path} should begin with a vertex element.")
    own = header[elements[0] + 1 : elements[1] if len(elements) > 1 else None]
    fields = [line.split()[1:] for line in own if line.startswith("property ")]
    try:
        layout = np.dtype([(name, SCALARS[kind]) for kind, name in fields])
    except (KeyError, ValueError) as error:
        raise ValueError(f"{path} has a vertex property that is not one number: {error}.") from error
    if missing := {"x", "y", "z", "label"} - set(layout.names or ()):
        raise ValueError(f"{path} has no vertex property {sorted(missing)[0]!r}.")
    return int(header[elements[0]].split()[2]), layout
