"""Depth along the colour camera's own axis: librealsense's align moves pixels, and leaves the distances alone."""

from __future__ import annotations

import numpy as np

from drivers.realsense.messages import RealSenseInfo
from openbelief.arrays import Array


class ColorDepth:
    """z_depth = R[2] . (z_color ray) + t[2], solved for z_color: 14 mm at 2 m for imagers turned by half a degree."""

    def __init__(self, info: RealSenseInfo) -> None:
        lens, T = info.intrinsics, info.T_depth_color
        v, u = np.mgrid[: lens.height, : lens.width]
        rays = lens.rays(u.ravel(), v.ravel())
        slant = rays @ T[2, :2] + T[2, 2]
        self._per_count = (info.depth_unit_m / slant).reshape(u.shape).astype(np.float32)
        self._offset_m = (T[2, 3] / slant).reshape(u.shape).astype(np.float32)

    def metres(self, counts: Array) -> Array:
        """(h, w) float32, 0 = no measurement, of (h, w) uint16."""
        depth_m = counts * self._per_count
        depth_m -= self._offset_m
        depth_m[counts == 0] = 0
        return depth_m
