"""Areas of the floor as polygons: which points lie inside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from openbelief.arrays import Array

Polygon: TypeAlias = tuple[tuple[float, float], ...]


def inside(points: Array, polygon: Array | Sequence[Sequence[float]]) -> Array:
    """(n,) bool: which (n, 2) points lie in the polygon of (k, 2) corners, closed by itself.

    Same frame and unit for both. Even-odd rule; a point on the border may count either way.
    """
    corners = np.asarray(polygon, dtype=np.float64)
    following = np.roll(corners, -1, axis=0)
    x, y = np.asarray(points, dtype=np.float64).reshape(-1, 2).T[..., None]
    straddles = (corners[:, 1] > y) != (following[:, 1] > y)
    rise = np.where(corners[:, 1] == following[:, 1], 1.0, following[:, 1] - corners[:, 1])
    crossing_x = corners[:, 0] + (y - corners[:, 1]) * (following[:, 0] - corners[:, 0]) / rise
    return np.count_nonzero(straddles & (x < crossing_x), axis=1) % 2 == 1
