"""sensor_msgs/CameraInfo read whole: which of its numbers hold for an image, and what is refused by name."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivers.ros.refusals import ImageReason, ImageRefused
from openbelief.arrays import Array
from openbelief.observation import Intrinsics

OPENCV_MODELS = ("", "plumb_bob", "rational_polynomial")
OPENCV_LENGTHS = (0, 4, 5, 8, 12, 14)
PINHOLE_MODELS = (
    *OPENCV_MODELS,
    "none",
    "pinhole",
    "perspective",
    "rectified",
    "brown_conrady",
    "inverse_brown_conrady",
)
BASELINE_PX = 1e-6  # P's fourth column is zero but for the right camera of a stereo pair


def is_rectified(topic: str) -> bool:
    """Whether image_pipeline's naming says so: image_rect, image_rect_color, color/rect/image, rectified ..."""
    words = topic.lower().replace("/", "_").split("_")
    return "rect" in words or any(word.startswith("rectif") for word in words)


def intrinsics(message: Any, *, rectified: bool = False) -> Intrinsics:
    """The camera of a CameraInfo: its K and D for the raw image, the left of P for a rectified one.

    Binning and region of interest are worked in, so width and height are those of the image. Only the numbers that are
    used have to be finite. Raises ImageRefused.
    """
    matrix, distortion = _projection(message) if rectified else _raw(message)
    x0, y0, width, height = _region(message, rectified)
    bin_x, bin_y = max(int(message.binning_x), 1), max(int(message.binning_y), 1)
    return Intrinsics(
        width // bin_x,
        height // bin_y,
        matrix[0, 0] / bin_x,
        matrix[1, 1] / bin_y,
        (matrix[0, 2] - x0) / bin_x,
        (matrix[1, 2] - y0) / bin_y,
        distortion,
    )


def described(message: Any) -> str:
    """The sizes that a CameraInfo speaks of, for a refusal."""
    roi = message.roi
    words = [f"camera info {message.width}x{message.height}"]
    if max(message.binning_x, message.binning_y) > 1:
        words.append(f"binning {message.binning_x}x{message.binning_y}")
    if roi.width or roi.height:
        words.append(f"roi {roi.width}x{roi.height} at ({roi.x_offset}, {roi.y_offset})")
    return " with ".join([words[0], " and ".join(words[1:])]) if words[1:] else words[0]


def _raw(message: Any) -> tuple[Array, tuple[float, ...]]:
    K, d = np.asarray(message.k, float).reshape(3, 3), np.asarray(message.d, float)
    if not (np.isfinite(K).all() and np.isfinite(d).all() and K[0, 0] > 0 and K[1, 1] > 0):
        raise ImageRefused(
            ImageReason.NO_CALIBRATION,
            f"CameraInfo has K {K.ravel().tolist()} and D {d.tolist()}: not finite, or zero.",
        )
    model = message.distortion_model.lower()
    known = OPENCV_MODELS if d.any() else PINHOLE_MODELS
    if model not in known or (d.any() and len(d) not in OPENCV_LENGTHS):
        raise ImageRefused(ImageReason.DISTORTION, f"CameraInfo has {len(d)} coefficients of {model!r}.")
    return K, tuple(d.tolist()) if d.any() else ()


def _projection(message: Any) -> tuple[Array, tuple[float, ...]]:
    """A rectified image has no distortion whatever D and the model say: those are of the raw image."""
    P = np.asarray(message.p, float).reshape(3, 4)
    if not (np.isfinite(P).all() and P[0, 0] > 0 and P[1, 1] > 0):
        raise ImageRefused(
            ImageReason.RECTIFICATION, f"The image is rectified, and CameraInfo has P {P.ravel().tolist()}."
        )
    if np.abs(P[:, 3]).max() > BASELINE_PX:
        raise ImageRefused(
            ImageReason.RECTIFICATION,
            f"P has a baseline ({P[0, 3]:g}): it is the right image of a stereo pair, seen from the left one's frame.",
        )
    return P[:, :3], ()


def _region(message: Any, rectified: bool) -> tuple[int, int, int, int]:
    """(x, y, width, height) of the part of the sensor that is sent; all zeros mean all of it."""
    roi = message.roi
    if not (roi.width or roi.height):
        return 0, 0, int(message.width), int(message.height)
    x, y, width, height = (int(v) for v in (roi.x_offset, roi.y_offset, roi.width, roi.height))
    if rectified and roi.do_rectify:
        raise ImageRefused(
            ImageReason.RECTIFICATION, f"CameraInfo's roi {width}x{height} is of the raw image, do_rectify says."
        )
    if x + width > message.width or y + height > message.height:
        raise ImageRefused(
            ImageReason.SIZES, f"CameraInfo's region of interest is not inside it: {described(message)}."
        )
    return x, y, width, height
