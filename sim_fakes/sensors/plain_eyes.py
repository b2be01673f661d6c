"""Senses that need no renderer: images and clouds of their own for every stamp, and nothing in them."""

from __future__ import annotations

import numpy as np

from drivers.ports import LidarCloud
from openbelief.arrays import Array
from openbelief.g1 import COLOR_INTRINSICS


class PlainEyes:
    """A wall two metres away, and a few points far off."""

    def image(self, T_map_camera: Array, stamp_ns: int) -> tuple[Array, Array]:  # noqa: ARG002
        shape = (COLOR_INTRINSICS.height, COLOR_INTRINSICS.width)
        colour = np.random.default_rng(stamp_ns).integers(60, 200, 3)  # no two alike: that would be a stuck camera
        return np.full((*shape, 3), colour, np.uint8), np.full(shape, 2.0, np.float32)

    def cloud(self, T_map_lidar: Array, stamp_ns: int) -> LidarCloud:  # noqa: ARG002
        points = np.random.default_rng(stamp_ns).uniform((20.0, -2.0, 1.0), (21.0, 2.0, 1.5), (32, 3))
        return LidarCloud(stamp_ns, points.astype(np.float32), "livox_frame")
