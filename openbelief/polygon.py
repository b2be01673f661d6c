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


def crossing(polygon: Array) -> tuple[Array, Array] | None:
    """The first two edges of a polygon that cross, (2, 2) corners each; None where none do. Ends may touch."""
    corners = np.asarray(polygon, dtype=np.float64)
    edges = np.stack((corners, np.roll(corners, -1, axis=0)), axis=1)
    for k in range(len(edges) - 2):
        others = edges[k + 2 :]
        apart = _side(edges[k], others[:, 0]) * _side(edges[k], others[:, 1]) < 0
        apart &= _side(others, edges[k, 0]) * _side(others, edges[k, 1]) < 0
        if apart.any():
            return edges[k], others[int(np.argmax(apart))]
    return None


def _side(edges: Array, points: Array) -> Array:
    """Where (..., 2) points lie of (..., 2, 2) edges: 1 to the left, -1 to the right, 0 on its line."""
    (x0, y0), (x1, y1) = np.moveaxis(edges[..., 0, :], -1, 0), np.moveaxis(edges[..., 1, :], -1, 0)
    x, y = np.moveaxis(points, -1, 0)
    return np.sign((x1 - x0) * (y - y0) - (y1 - y0) * (x - x0))
