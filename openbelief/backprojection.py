"""From pixels with depth to points in the map, and from points to occupied voxels."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array
from openbelief.observation import RgbdFrame
from openbelief.parameters import Parameters
from openbelief.pose import apply


def backproject(pixels: Array, frame: RgbdFrame, parameters: Parameters) -> Array:
    """(n, 3) float32, map frame, metres: one point per pixel of the mask whose depth is in the trusted range.

    pixels: (h, w) bool. n may be 0. A depth of 0, NaN or outside [depth_min_m, depth_max_m] is no measurement.
    Raises ValueError where the mask has not the frame's shape.
    """
    mask = np.asarray(pixels, dtype=bool)
    if mask.shape != frame.depth_m.shape:
        raise ValueError(f"Shape of pixels should be {frame.depth_m.shape} as the frame's depth, got {mask.shape}.")
    v, u = np.nonzero(mask)
    depth = frame.depth_m[v, u].astype(np.float64)
    measured = (depth >= parameters.depth_min_m) & (depth <= parameters.depth_max_m)  # NaN compares false
    if not measured.any():
        return np.zeros((0, 3), np.float32)
    z = depth[measured]
    rays = frame.intrinsics.rays(u[measured], v[measured])
    return apply(frame.T_map_camera, np.column_stack((rays * z[:, None], z))).astype(np.float32)


def snap(points: Array, voxel_m: float) -> Array:
    """(k, 3) float32: the centre of every occupied voxel, once, in lexicographic order; snapping twice changes nothing.

    points: (n, 3), finite, n may be 0. Voxels are aligned with the map's axes, so two clouds share their voxels.
    """
    return occupied_voxels(points, voxel_m)[0]


def occupied_voxels(points: Array, voxel_m: float) -> tuple[Array, Array]:
    """The centres of `snap`, and (k,) int: how many of the points each voxel holds."""
    if len(points) == 0:
        return np.zeros((0, 3), np.float32), np.zeros(0, np.int64)
    voxels = np.floor(np.asarray(points, np.float64) / voxel_m).astype(np.int64)
    low = voxels.min(axis=0)
    size = voxels.max(axis=0) - low + 1
    keys, counts = np.unique(np.ravel_multi_index(tuple((voxels - low).T), tuple(size)), return_counts=True)
    unique = np.column_stack(np.unravel_index(keys, tuple(size))) + low
    return ((unique + 0.5) * voxel_m).astype(np.float32), counts
