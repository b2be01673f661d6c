"""Regions that are ways rather than rooms: long, narrow, and beside several others."""

from __future__ import annotations

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.basins import beside, nearest_label

LONG = 3.0  # times as long as it is wide
OTHERS = 3  # regions that it lies beside
WALL_M = 0.4  # regions this far apart lie beside each other


def passages(labels: Array, count: int, resolution_m: float) -> Array:
    """(count,) bool: which of the regions 1 to count of (h, w) labels, 0 elsewhere, are passages."""
    others = _others_beside(labels, count, resolution_m)
    return np.array([others[k] >= OTHERS and _times_as_long(labels == k + 1) >= LONG for k in range(count)], bool)


def _others_beside(labels: Array, count: int, resolution_m: float) -> Array:
    """(count,) int: how many others each region touches, through a wall too."""
    away, nearest = nearest_label(labels)
    grown = np.where(away * resolution_m <= WALL_M / 2 + resolution_m, nearest, 0)
    touch = np.zeros((count + 1, count + 1), bool)
    for one, other in beside(grown):
        touch[one, other] = touch[other, one] = True
    np.fill_diagonal(touch, False)
    return touch[1:, 1:].sum(axis=1)


def _times_as_long(region: Array) -> float:
    """Its area as squares of its width, which is that of the largest circle inside: bays and bends hardly count."""
    inside_cells = cv2.distanceTransform(np.pad(region, 1).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE).max()
    return float(region.sum() / max(2.0 * inside_cells - 1.0, 1.0) ** 2)
