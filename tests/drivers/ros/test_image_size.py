"""A small payload may not make us allocate gigabytes."""

from __future__ import annotations

import struct
import zlib

import cv2
import numpy as np
import pytest

from drivers.ros.image_size import declared_size
from drivers.ros.images import ImageRefused, color_image
from drivers.ros.messages import make


def encoded(extension, width=64, height=48):
    image = np.random.default_rng(1).integers(0, 256, (height, width, 3), dtype=np.uint8)
    return cv2.imencode(extension, image)[1].tobytes()


def huge(extension):
    """The same file with 30 000 x 30 000 pixels in its header: 2.7 GB, still below what OpenCV refuses."""
    data = bytearray(encoded(extension))
    if extension == ".png":
        data[16:24] = struct.pack(">II", 30_000, 30_000)
        data[29:33] = struct.pack(">I", zlib.crc32(bytes(data[12:29])))
    else:
        at = data.find(b"\xff\xc0")
        data[at + 5 : at + 9] = struct.pack(">HH", 30_000, 30_000)
    return bytes(data)


def message(data):
    return make("sensor_msgs/msg/CompressedImage", format="x", data=np.frombuffer(data, np.uint8))


@pytest.mark.parametrize("extension", [".png", ".jpg"])
def test_the_declared_size_is_the_size(extension):
    assert declared_size(encoded(extension, 37, 21)) == (37, 21)
    assert color_image(message(encoded(extension))).shape == (48, 64, 3)


@pytest.mark.parametrize("extension", [".png", ".jpg"])
def test_an_image_that_declares_gigabytes_is_refused(extension):
    with pytest.raises(ImageRefused):
        color_image(message(huge(extension)))


@pytest.mark.parametrize("extension", [".png", ".jpg"])
def test_flipped_bits_are_refused_or_decode(extension):
    data, rng = encoded(extension), np.random.default_rng(2)
    for _ in range(300):
        flipped = bytearray(data)
        for position in rng.integers(0, min(len(data), 700), 3):
            flipped[position] ^= 1 << int(rng.integers(0, 8))
        try:
            image = color_image(message(bytes(flipped)))
        except ImageRefused:
            continue
        assert image.ndim == 3 and image.shape[2] == 3


@pytest.mark.parametrize(
    "data", [b"", b"\xff\xd8", b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n", b"GIF89a", b"\xff\xd8\xff\xda\x00\x02"]
)
def test_what_is_no_image_has_no_size(data):
    with pytest.raises(ValueError, match=r"cut off|neither|before its size"):
        declared_size(data)
