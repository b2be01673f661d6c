from __future__ import annotations

import cv2
import numpy as np
import pytest

from drivers.ros.encodings import COLOR_ENCODINGS
from drivers.ros.images import color_image
from drivers.ros.messages import make

RED = np.zeros((8, 8, 3), np.uint8)
RED[:] = (200, 40, 30)


def bayer(pattern: str) -> np.ndarray:
    """A mosaic of RED: ROS names its first two rows."""
    mosaic = np.empty(RED.shape[:2], np.uint8)
    for i, letter in enumerate(pattern):
        mosaic[i // 2 :: 2, i % 2 :: 2] = RED[0, 0, "rgb".index(letter)]
    return mosaic


def pixels_of(encoding: str) -> np.ndarray:
    """RED as a camera of that encoding sends it."""
    name, wide = encoding.removesuffix("16"), encoding.endswith("16")
    name = name.removesuffix("8")
    alpha = np.dstack((RED, np.full(RED.shape[:2], 9, np.uint8)))
    yuv = cv2.cvtColor(RED, cv2.COLOR_RGB2YUV_I420)
    y, u, v = yuv[0, 0], yuv.ravel()[64], yuv.ravel()[80]
    forms = {
        "rgb": RED,
        "bgr": RED[:, :, ::-1],
        "8UC3": RED[:, :, ::-1],
        "rgba": alpha,
        "bgra": alpha[:, :, [2, 1, 0, 3]],
        "8UC4": alpha[:, :, [2, 1, 0, 3]],
        **dict.fromkeys(("yuv422", "uyvy"), np.tile(np.uint8([[u, y], [v, y]]), (8, 4, 1))),
        **dict.fromkeys(("yuv422_yuy2", "yuyv"), np.tile(np.uint8([[y, u], [y, v]]), (8, 4, 1))),
        "nv12": np.vstack((np.full((8, 8), y, np.uint8), np.tile(np.uint8([u, v]), (4, 4)))),
        "nv21": np.vstack((np.full((8, 8), y, np.uint8), np.tile(np.uint8([v, u]), (4, 4)))),
    }
    pixels = bayer(name.removeprefix("bayer_")) if name.startswith("bayer_") else forms[name]
    return pixels.astype(np.uint16) << 8 if wide else pixels


@pytest.mark.parametrize("encoding", [e for e in COLOR_ENCODINGS if "mono" not in e and e != "8UC1"])
def test_red_is_red_in_every_encoding(encoding):
    rows = np.ascontiguousarray(pixels_of(encoding))
    step = rows[0].nbytes
    message = make(
        "sensor_msgs/msg/Image", height=8, width=8, encoding=encoding, step=step, data=rows.view(np.uint8).ravel()
    )
    np.testing.assert_allclose(color_image(message)[2:6, 2:6], RED[2:6, 2:6], atol=4)


@pytest.mark.parametrize("encoding", ["mono8", "mono16", "8UC1"])
def test_grey_is_grey_in_every_encoding(encoding):
    grey = np.full((8, 8), 77, np.uint8)
    rows = grey.astype(np.uint16) << 8 if encoding == "mono16" else grey
    message = make(
        "sensor_msgs/msg/Image",
        height=8,
        width=8,
        encoding=encoding,
        step=rows[0].nbytes,
        data=rows.view(np.uint8).ravel(),
    )
    assert (color_image(message) == 77).all()
