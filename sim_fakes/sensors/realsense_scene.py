"""A box before a wall, exactly: what any pinhole camera sees of it, for judging alignment to the millimetre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array
from openbelief.observation import Intrinsics

WALL_RGB, BOX_RGB = (90, 110, 140), (200, 60, 40)


@dataclass(frozen=True)
class BoxScene:
    """In the colour camera's frame (x right, y down, z forward), metres: a wall across, and a box's front face."""

    wall_m: float = 2.0
    box_m: float = 1.2
    box: tuple[float, float, float, float] = (-0.3, -0.2, 0.3, 0.2)  # x0, y0, x1, y1 of the face

    def seen(self, intrinsics: Intrinsics, T_color_camera: Array) -> tuple[Array, Array]:
        """color (h, w, 3) uint8 RGB and depth_m (h, w) float32 along the camera's own axis.

        T_color_camera: (4, 4); the camera may not look away from the wall.
        """
        height, width = intrinsics.height, intrinsics.width
        v, u = np.mgrid[:height, :width]
        directions = np.column_stack((intrinsics.rays(u.ravel(), v.ravel()), np.ones(u.size)))
        directions = directions @ T_color_camera[:3, :3].T
        origin = T_color_camera[:3, 3]
        on_box = origin + directions * ((self.box_m - origin[2]) / directions[:, 2:])
        x0, y0, x1, y1 = self.box
        hit = (on_box[:, 0] >= x0) & (on_box[:, 0] <= x1) & (on_box[:, 1] >= y0) & (on_box[:, 1] <= y1)
        depth = np.where(hit, self.box_m - origin[2], self.wall_m - origin[2]) / directions[:, 2]
        color = np.where(hit[:, None], BOX_RGB, WALL_RGB).astype(np.uint8)
        return color.reshape(height, width, 3), depth.reshape(height, width).astype(np.float32)
