"""Polygons on the floor: keep-out areas and the allowed region."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from openbelief.arrays import Array

Polygon: TypeAlias = tuple[tuple[float, float], ...]


def inside(xy: Array, polygon: Polygon) -> bool:
    """Whether a point lies in a polygon (map frame, metres), closed by itself; even-odd rule."""
    corners = np.asarray(polygon, np.float64)
    following = np.roll(corners, -1, axis=0)
    straddles = (corners[:, 1] > xy[1]) != (following[:, 1] > xy[1])
    rise = np.where(straddles, following[:, 1] - corners[:, 1], 1.0)
    crossing_x = corners[:, 0] + (xy[1] - corners[:, 1]) / rise * (following[:, 0] - corners[:, 0])
    return bool(np.count_nonzero(straddles & (xy[0] < crossing_x)) % 2)
