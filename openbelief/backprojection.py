"""From pixels with depth to points in the map, and from points to occupied voxels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from openbelief.arrays import Array
from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.run_lengths import mask_bbox


def backproject(
    pixels: Array, frame: RgbdFrame, parameters: Parameters, bbox: tuple[int, int, int, int] | None = None
) -> Array:
    """(n, 3) float32, map frame, metres: one point per pixel of the mask whose depth is in the trusted range.

    pixels: (h, w) bool. bbox: the box around them, where it is known. n may be 0. A depth of 0, NaN or outside
    [depth_min_m, depth_max_m] is no measurement. Raises ValueError where the mask has not the frame's shape.
    """
    mask = np.asarray(pixels, dtype=bool)
    if mask.shape != frame.depth_m.shape:
        raise ValueError(f"Shape of pixels should be {frame.depth_m.shape} as the frame's depth, got {mask.shape}.")
    if not mask.any():
        return np.zeros((0, 3), np.float32)
    x0, y0, x1, y1 = bbox or mask_bbox(mask)
    box = slice(y0, y1), slice(x0, x1)
    depth_m = frame.depth_m[box]
    measured = (depth_m >= parameters.depth_min_m) & (depth_m <= parameters.depth_max_m)  # NaN compares false
    measured &= mask[box]
    at = np.flatnonzero(measured)
    points_camera = np.empty((3, len(at)))
    z = points_camera[2]
    z[:] = depth_m.ravel().take(at)
    for axis, rays in zip(points_camera, ray_table(frame.intrinsics), strict=False):
        np.multiply(rays[box].ravel().take(at), z, out=axis)
    T = frame.T_map_camera
    points = T[:3, :3] @ points_camera
    points += T[:3, 3:]
    return points.astype(np.float32).T


def depth_points(depth_m: Array, camera: Intrinsics, stride: int, depth_max_m: float) -> Array:
    """(n, 3) float64, optical frame, metres: every stride-th row and column that measured something up to a depth."""
    thin = slice(None, None, stride), slice(None, None, stride)
    measured = (depth_m[thin] > 0) & (depth_m[thin] <= depth_max_m)
    z = depth_m[thin][measured].astype(np.float64)
    ray_x, ray_y = ray_table(camera)
    return np.column_stack((ray_x[thin][measured] * z, ray_y[thin][measured] * z, z))


@lru_cache(maxsize=4)
def ray_table(intrinsics: Intrinsics) -> Array:
    """(2, h, w) float64 normalised image coordinates (x/z, y/z) of every pixel: undistorted once."""
    v, u = np.divmod(np.arange(intrinsics.width * intrinsics.height), intrinsics.width)
    return np.ascontiguousarray(intrinsics.rays(u, v).T).reshape(2, intrinsics.height, intrinsics.width)


@dataclass(frozen=True)
class Voxels:
    """Occupied voxels, each once, in lexicographic order, and how many points each holds.

    steps: (3, k) int64, from `low`, (3,) int64. counts: (k,) int64.
    """

    steps: Array
    low: Array
    counts: Array
    voxel_m: float

    def centres(self, chosen: Array | None = None) -> Array:
        """(j, 3) float32, map frame, metres: of the (k,) bool chosen ones, or all."""
        steps = self.steps if chosen is None else self.steps.compress(chosen, axis=1)
        centres = (steps + self.low[:, None]) + 0.5
        centres *= self.voxel_m
        return centres.astype(np.float32).T


def snap(points: Array, voxel_m: float) -> Array:
    """(k, 3) float32: the centre of every occupied voxel, once, in lexicographic order; snapping twice changes nothing.

    points: (n, 3), finite, n may be 0. Voxels are aligned with the map's axes, so two clouds share their voxels.
    """
    return occupied_voxels(points, voxel_m).centres()


def distinct_points(points: Array, voxel_m: float) -> Array:
    """The distinct rows of (n, 3) float32 points, in lexicographic order; as voxels where all are voxels' centres."""
    if _centred(points, voxel_m):
        return occupied_voxels(points, voxel_m).centres()
    ordered = points[np.lexsort(points.T[::-1])]
    return ordered[np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))]


def _centred(points: Array, voxel_m: float) -> bool:
    """Is every point, to the bit, what `Voxels.centres` gives for its voxel, and for no other one?"""
    centres = points.astype(np.float64)
    centres /= voxel_m
    np.floor(centres, out=centres)
    tell_apart = np.abs(centres).max(initial=0.0) < 1 << 22  # two bits less than float32 has
    centres += 0.5
    centres *= voxel_m
    return bool(tell_apart and np.array_equal(centres.astype(np.float32), points))


def occupied_voxels(points: Array, voxel_m: float) -> Voxels:
    """The voxels of (n, 3) points. Raises ValueError where voxel_m is too small to count those along their box."""
    if len(points) == 0:
        return Voxels(np.zeros((3, 0), np.int64), np.zeros(3, np.int64), np.zeros(0, np.int64), voxel_m)
    axes = np.ascontiguousarray(np.asarray(points).T)
    low, high = (np.floor(ends / np.float64(voxel_m)) for ends in (axes.min(axis=1), axes.max(axis=1)))
    voxels = axes / np.float64(voxel_m)
    np.floor(voxels, out=voxels)
    voxels -= low[:, None]
    sides = [int(side) + 1 for side in high - low]
    if sides[0] * sides[1] * sides[2] >= 1 << 62:
        raise ValueError("voxel_m is too small for things of its size")
    voxels = voxels.astype(np.int32 if sides[0] * sides[1] * sides[2] < 1 << 31 else np.int64)  # sorts twice as fast
    keys = voxels[0]
    keys *= sides[1]
    keys += voxels[1]
    keys *= sides[2]
    keys += voxels[2]
    keys.sort()
    keys, counts = runs(keys)
    x, rest = _divided(keys, sides[1] * sides[2])
    steps = np.stack((x, *_divided(rest, sides[2])), dtype=np.int64)
    return Voxels(steps, low.astype(np.int64), counts, voxel_m)


def runs(ascending: Array) -> tuple[Array, Array]:
    """Each of (n,) ascending whole numbers once, and (k,) int64 how often it stands there."""
    ends = np.ones(len(ascending) + 1, bool)
    np.not_equal(ascending[1:], ascending[:-1], out=ends[1:-1])
    at = np.flatnonzero(ends)
    return ascending[at[:-1]], at[1:] - at[:-1]


def _divided(numbers: Array, by: int) -> tuple[Array, Array]:
    """Quotients and remainders of whole numbers from 0: five times as fast as np.divmod, which minds the sign."""
    quotients = numbers // by
    return quotients, numbers - quotients * by
