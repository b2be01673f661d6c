"""Paths on the floor as polylines: how far along, and the points at given distances."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array


def arc_length(points: Array) -> Array:
    """(n,) metres from the first of (n, 2) points to each, along them."""
    return np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))


def path_length(points: Array) -> float:
    """Metres along (n, 2) points."""
    return float(arc_length(points)[-1])


def resampled(points: Array, step_m: float) -> tuple[Array, Array]:
    """(m,) metres along the polyline and (m, 2) its points there, at most `step_m` apart, both ends included."""
    along = arc_length(points)
    at = np.linspace(0.0, along[-1], max(int(np.ceil(along[-1] / step_m)), 1) + 1)
    return at, at_distances(points, along, at)


def at_distances(points: Array, along: Array, at: Array | float) -> Array:
    """(..., 2) the points (...) metres along the polyline, clamped to its ends. along: its `arc_length`."""
    return np.stack([np.interp(at, along, points[:, axis]) for axis in (0, 1)], axis=-1)
