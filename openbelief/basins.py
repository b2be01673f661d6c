"""Rooms that no door divides: a watershed over the distance to walls, joined again where the way between is wide."""

from __future__ import annotations

import cv2
import numpy as np

from openbelief.arrays import Array

PEAK_M, PEAK_APART_M = 0.4, 0.6  # the middle of a region is so far from its walls, and from the next one's middle
NARROW = 0.7  # a passage narrower than this share of both sides' widths divides them
WIDE_M = 1.3  # one whose middle is so far from the walls does not
PART_MIN_M2 = 7.0  # a smaller part of what neither walls nor doorways divide is a corner of it
STEEPER = 1e-3  # how much the nearer end of a way counts beside the farther one
ROOM_MIN_M2 = 2.0


def divided(floor: Array, resolution_m: float) -> Array:
    """(h, w) int, 0 where there is no room. floor: (h, w) bool, what lies between walls and doorways."""
    ground = np.pad(floor, 1).astype(np.uint8)
    distance_m = cv2.distanceTransform(ground, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1] * resolution_m
    size = max(1, round(PEAK_APART_M / resolution_m))
    highest = distance_m == cv2.dilate(distance_m, np.ones((size, size), np.uint8))
    count, peaks = cv2.connectedComponents((highest & (distance_m > PEAK_M)).astype(np.uint8))
    if count == 1:
        return np.zeros(floor.shape, np.int64)
    parts = _joined(_basins(floor, distance_m, peaks), distance_m, resolution_m)
    return np.where(floor, nearest_label(_without_small(parts, resolution_m))[1], 0)  # what is too narrow for a room


def nearest_label(labels: Array) -> tuple[Array, Array]:
    """How many cells it is to the nearest label above 0 of (h, w) int, inf where there is none, and that label."""
    if not labels.any():
        return np.full(labels.shape, np.inf, np.float32), labels
    outside = (labels == 0).astype(np.uint8)
    away, number = cv2.distanceTransformWithLabels(outside, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    label_of = np.zeros(int(number.max()) + 1, labels.dtype)
    label_of[number[labels > 0]] = labels[labels > 0]
    return away, label_of[number]


def _basins(floor: Array, height: Array, peaks: Array) -> Array:
    """(h, w) int: the watershed of a height on the floor, each cell with the number of a peak that water came from.

    It is cut by the spanning forest of the highest ways to the peaks (Cousty et al., PAMI 2009); of ways alike the
    steeper one is taken, and then the first of the grid.
    """
    cells = np.arange(floor.size).reshape(floor.shape)
    ways = [np.stack((a[f & g], b[f & g])) for (a, b), (f, g) in zip(beside(cells), beside(floor), strict=True)]
    ends = np.concatenate(ways, axis=1)
    shallow, deep = np.sort(-height.ravel().astype(np.float64)[ends], axis=0)
    ends = ends[:, np.argsort(deep + STEEPER * shallow, kind="stable")]
    return peaks.ravel()[_rooted(ends, peaks.ravel() > 0)].reshape(floor.shape) * floor


def _rooted(ends: Array, is_root: Array) -> Array:
    """(n,) which of (n,) roots each node comes to in the least spanning forest; another node where it comes to none.

    ends: (2, m), what each edge joins, the least edge first. Boruvka's steps: every tree without a root takes its
    least edge out of it.
    """
    root = np.arange(len(is_root))
    while True:
        one, other = root[ends]
        useful = (one != other) & ~(is_root[one] & is_root[other])
        ends, one, other = ends[:, useful], one[useful], other[useful]
        if not len(one):
            return root
        out = np.arange(len(root))
        froms, tos = np.stack((one, other), axis=1).ravel()[::-1], np.stack((other, one), axis=1).ravel()[::-1]
        out[froms] = tos  # the last of several counts: of each tree the least edge
        out[is_root] = np.flatnonzero(is_root)
        mutual = (out[out] == np.arange(len(out))) & (np.arange(len(out)) < out)
        out[mutual] = np.flatnonzero(mutual)
        while (out[out] != out).any():
            out = out[out]
        root = out[root]


def beside(image: Array) -> tuple[tuple[Array, Array], ...]:
    """An image's pixels, and those below them; and those to the right of them."""
    return (image[:-1], image[1:]), (image[:, :-1], image[:, 1:])


def _joined(basins: Array, distance_m: Array, resolution_m: float) -> Array:
    """Basins become one, widest pass first, where one is small or the pass not much narrower than both of them."""
    count = int(basins.max())
    area_m2 = np.bincount(basins.ravel(), minlength=count + 1) * resolution_m**2
    height = np.zeros(count + 1)
    np.maximum.at(height, basins.ravel(), distance_m.ravel())
    parent = list(range(count + 1))

    def root(i: int) -> int:
        while parent[i] != i:
            i = parent[i]
        return i

    for (a, b), pass_m in sorted(_passes(basins, distance_m).items(), key=lambda item: (-item[1], item[0])):
        a, b = root(a), root(b)
        wide = pass_m >= min(WIDE_M, NARROW * min(height[a], height[b]))
        if a != b and (wide or min(area_m2[a], area_m2[b]) < PART_MIN_M2):
            parent[b], height[a] = a, max(height[a], height[b])
            area_m2[a] += area_m2[b]
    return np.array([root(i) for i in range(count + 1)])[basins]


def _passes(basins: Array, distance_m: Array) -> dict[tuple[int, int], float]:
    """Neighbouring basins (a < b) -> the greatest distance to a wall on their common border."""
    passes: dict[tuple[int, int], float] = {}
    for (a, b), (up, down) in zip(beside(basins), beside(distance_m), strict=True):
        border = (a != b) & (a > 0) & (b > 0)
        sides = np.sort(np.stack((a[border], b[border])), axis=0)
        for one, other, low in zip(*sides.tolist(), np.minimum(up, down)[border].tolist(), strict=True):
            passes[one, other] = max(passes.get((one, other), 0.0), low)
    return passes


def _without_small(basins: Array, resolution_m: float) -> Array:
    """A region too small for a room joins the one that it borders most on; one that borders on none goes."""
    basins = basins.copy()
    while True:
        sizes = np.bincount(basins.ravel())
        sizes[0] = 0
        small = np.flatnonzero((sizes > 0) & (sizes * resolution_m**2 < ROOM_MIN_M2))
        if not len(small):
            return basins
        smallest = small[np.argmin(sizes[small])]
        region = basins == smallest
        ring = cv2.dilate(region.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool) & ~region
        around = basins[ring & (basins > 0)]
        basins[region] = np.bincount(around).argmax() if len(around) else 0
