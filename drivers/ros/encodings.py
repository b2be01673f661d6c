"""The raw colour encodings of sensor_msgs/Image (sensor_msgs/image_encodings.h) and how each becomes RGB."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from openbelief.arrays import Array


@dataclass(frozen=True)
class ColorEncoding:
    """dtype, channels: of one pixel in a row. rows: image rows in the data for each two of the picture (NV12 has 3).

    to_rgb: (h, w, channels) to (h, w, 3) uint8. even: both sides of the picture have to be even.
    """

    dtype: str
    channels: int
    to_rgb: Callable[[Array], Array]
    rows: int = 2
    even: bool = False


def _cv(code: int) -> Callable[[Array], Array]:
    return lambda pixels: cv2.cvtColor(pixels, code)


def _top(to_rgb: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """Of 16 bits the upper eight."""
    return lambda pixels: to_rgb((pixels >> 8).astype(np.uint8))


def _plane(code: int) -> Callable[[Array], Array]:
    return lambda pixels: cv2.cvtColor(np.ascontiguousarray(pixels[:, :, 0]), code)


def _as_is(pixels: Array) -> Array:
    return pixels


PLAIN: dict[str, tuple[int, Callable[[Array], Array]]] = {
    "rgb": (3, _as_is),
    "bgr": (3, _cv(cv2.COLOR_BGR2RGB)),
    "rgba": (4, _cv(cv2.COLOR_RGBA2RGB)),
    "bgra": (4, _cv(cv2.COLOR_BGRA2RGB)),
    "mono": (1, _cv(cv2.COLOR_GRAY2RGB)),
}
BAYER = {  # ROS names a mosaic by its first two rows, OpenCV's older names by the second
    "rggb": cv2.COLOR_BayerBG2RGB,
    "bggr": cv2.COLOR_BayerRG2RGB,
    "gbrg": cv2.COLOR_BayerGR2RGB,
    "grbg": cv2.COLOR_BayerGB2RGB,
}
UYVY, YUY2 = (ColorEncoding("u1", 2, _cv(c), even=True) for c in (cv2.COLOR_YUV2RGB_UYVY, cv2.COLOR_YUV2RGB_YUY2))
NAMELESS = (
    "8UC1",
    "8UC3",
    "8UC4",
)  # OpenCV types that do not say what their channels are; cv_bridge takes them for BGR

COLOR_ENCODINGS: dict[str, ColorEncoding] = {
    **{f"{name}8": ColorEncoding("u1", n, rgb) for name, (n, rgb) in PLAIN.items()},
    **{f"{name}16": ColorEncoding("u2", n, _top(rgb)) for name, (n, rgb) in PLAIN.items()},
    **{f"bayer_{name}8": ColorEncoding("u1", 1, _plane(code), even=True) for name, code in BAYER.items()},
    **{f"bayer_{name}16": ColorEncoding("u2", 1, _top(_plane(code)), even=True) for name, code in BAYER.items()},
    **{f"8UC{PLAIN[name][0]}": ColorEncoding("u1", *PLAIN[name]) for name in ("mono", "bgr", "bgra")},
    **dict.fromkeys(("yuv422", "uyvy"), UYVY),
    **dict.fromkeys(("yuv422_yuy2", "yuyv"), YUY2),
    "nv12": ColorEncoding("u1", 1, _plane(cv2.COLOR_YUV2RGB_NV12), rows=3, even=True),
    "nv21": ColorEncoding("u1", 1, _plane(cv2.COLOR_YUV2RGB_NV21), rows=3, even=True),
}
