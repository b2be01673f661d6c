"""Pictures as the small networks take them."""

from __future__ import annotations

import cv2
import numpy as np

from openbelief.arrays import Array

IMAGENET = ((0.485, 0.456, 0.406), (0.229, 0.224, 0.225))


def network_input(
    picture: Array, side: int, normal: tuple[tuple[float, ...], tuple[float, ...]], *, white: int = 255
) -> Array:
    """(3, side, side) float32 of (h, w, 3) uint8 RGB: squeezed into a square, over white, less the mean, over the std.

    Area averaging: linear interpolation loses what a mask hangs on when a large box is shrunk.
    """
    mean, std = (np.array(part, dtype=np.float32) for part in normal)
    small = cv2.resize(np.ascontiguousarray(picture), (side, side), interpolation=cv2.INTER_AREA)
    return ((small.astype(np.float32) / white - mean) / std).transpose(2, 0, 1)
