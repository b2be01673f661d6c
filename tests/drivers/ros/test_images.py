from __future__ import annotations

import struct

import cv2
import numpy as np
import pytest

from drivers.ros import rvl
from drivers.ros.images import color_image, depth_image, is_depth
from drivers.ros.messages import decode, encode, make
from drivers.ros.refusals import ImageRefused

RGB = np.random.default_rng(0).integers(0, 256, (5, 7, 3), dtype=np.uint8)
DEPTH_M = np.round(np.random.default_rng(1).uniform(0.2, 6, (5, 7)), 3).astype(np.float32)


def image(pixels, encoding, *, pad=0, big_endian=False):
    """An Image over the wire, so that arrays come back as read-only views."""
    kind = pixels.dtype.newbyteorder(">" if big_endian else "<")
    rows = np.ascontiguousarray(pixels.astype(kind)).view(np.uint8).reshape(pixels.shape[0], -1)
    rows = np.pad(rows, ((0, 0), (0, pad)), constant_values=255)
    message = make(
        "sensor_msgs/msg/Image",
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        is_bigendian=int(big_endian),
        step=rows.shape[1],
        data=rows.ravel(),
    )
    return decode(encode(message), "sensor_msgs/msg/Image")


def compressed(data: bytes, description: str):
    message = make("sensor_msgs/msg/CompressedImage", format=description, data=np.frombuffer(data, np.uint8))
    return decode(encode(message), "sensor_msgs/msg/CompressedImage")


ALPHA = np.full((5, 7, 1), 9, np.uint8)
COLORS = {
    "rgb8": RGB,
    "bgr8": RGB[:, :, ::-1],
    "rgba8": np.concatenate((RGB, ALPHA), axis=2),
    "bgra8": np.concatenate((RGB[:, :, ::-1], ALPHA), axis=2),
}


@pytest.mark.parametrize("encoding", COLORS)
@pytest.mark.parametrize("pad", [0, 3])
def test_every_colour_encoding_gives_the_same_rgb_whatever_the_row_padding(encoding, pad):
    np.testing.assert_array_equal(color_image(image(COLORS[encoding], encoding, pad=pad)), RGB)


def test_grey_becomes_three_equal_channels():
    grey = color_image(image(RGB[:, :, :1], "mono8"))
    np.testing.assert_array_equal(grey, np.repeat(RGB[:, :, :1], 3, axis=2))


def test_png_colour_is_lossless_and_a_cut_jpeg_is_refused():
    png = cv2.imencode(".png", RGB[:, :, ::-1])[1].tobytes()
    np.testing.assert_array_equal(color_image(compressed(png, "rgb8; png compressed bgr8")), RGB)
    with pytest.raises(ImageRefused, match="do not decode"):
        color_image(compressed(b"\xff\xd8\xff", "jpeg"))
    with pytest.raises(ImageRefused, match="do not decode"):
        color_image(compressed(b"", "jpeg"))


@pytest.mark.parametrize("big_endian", [False, True])
@pytest.mark.parametrize("pad", [0, 6])
def test_millimetres_and_metres_agree_in_either_byte_order(big_endian, pad):
    millimetres = np.rint(DEPTH_M * 1000).astype(np.uint16)[:, :, None]
    raw = image(millimetres, "16UC1", pad=pad, big_endian=big_endian)
    np.testing.assert_allclose(depth_image(raw), DEPTH_M, atol=1e-6)
    metres = image(DEPTH_M[:, :, None], "32FC1", pad=pad, big_endian=big_endian)
    np.testing.assert_array_equal(depth_image(metres), DEPTH_M)


def test_what_is_not_a_measurement_is_zero():
    values = np.array([[[np.nan], [np.inf], [-1.0], [0.0], [2.0]]], np.float32)
    assert depth_image(image(values, "32FC1")).tolist() == [[0, 0, 0, 0, 2]]


def test_compressed_depth_png_in_millimetres_and_as_quantised_inverse_depth():
    millimetres = np.rint(DEPTH_M * 1000).astype(np.uint16)
    png = cv2.imencode(".png", millimetres)[1].tobytes()
    np.testing.assert_allclose(
        depth_image(compressed(struct.pack("<iff", 0, 0, 0) + png, "16UC1; compressedDepth png")), DEPTH_M, atol=1e-6
    )
    a = 100.0 * (100.0 + 1.0)
    b = 1.0 - a / 10.0  # the transport's own quantisation for depth_max 10 m, quantisation 100
    quantised = np.where(DEPTH_M > 5, 0, np.rint(a / DEPTH_M + b)).astype(np.uint16)
    png = cv2.imencode(".png", quantised)[1].tobytes()
    depth = depth_image(compressed(struct.pack("<iff", 0, a, b) + png, "32FC1; compressedDepth png"))
    np.testing.assert_allclose(depth, np.where(DEPTH_M > 5, 0, DEPTH_M), rtol=5e-3)


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (lambda: image(RGB, "32SC3"), "colour encoding not supported"),
        (lambda: image(RGB[:, :, :2], "yuv422"), "image is malformed"),  # an odd width
        (lambda: compressed(b"\0\0\0\1h", "h264"), "colour encoding not supported"),
        (lambda: make("sensor_msgs/msg/Image", height=4, width=4, encoding="rgb8", step=12), "image is malformed"),
        (
            lambda: make("sensor_msgs/msg/Image", height=2**31, width=2**31, encoding="rgb8", step=3),
            "image is malformed",
        ),
    ],
)
def test_a_colour_image_that_cannot_be_read_is_refused_by_reason(message, reason):
    with pytest.raises(ImageRefused) as refused:
        color_image(message())
    assert refused.value.reason == reason


def test_a_cut_rvl_depth_as_jpeg_and_colour_as_depth_are_refused_not_misread():
    with pytest.raises(ImageRefused, match="0x0 pixels"):
        depth_image(compressed(bytes(64), "16UC1; compressedDepth rvl"))
    whole = struct.pack("<iffII", 0, 0, 0, 7, 5) + rvl.encode(np.rint(DEPTH_M * 1000).astype(np.uint16))
    with pytest.raises(ImageRefused, match="does not fit 35 pixels"):
        depth_image(compressed(whole[:-8], "16UC1; compressedDepth rvl"))
    jpeg = cv2.imencode(".jpg", RGB)[1].tobytes()
    with pytest.raises(ImageRefused, match="is a JPEG, which has 8 bits"):
        depth_image(compressed(jpeg, "16UC1; jpeg compressed "))
    with pytest.raises(ImageRefused, match="16-bit"):
        depth_image(compressed(cv2.imencode(".png", RGB)[1].tobytes(), "16UC1; compressedDepth png"))
    with pytest.raises(ImageRefused, match="'rgb8'"):
        depth_image(image(RGB, "rgb8"))


def test_depth_is_told_from_colour_by_what_the_message_says():
    assert is_depth(compressed(b"x", "16UC1; compressedDepth png")) and is_depth(image(DEPTH_M[:, :, None], "32FC1"))
    assert not is_depth(compressed(b"x", "jpeg")) and not is_depth(image(RGB, "rgb8"))
    grey = cv2.imencode(".png", np.rint(DEPTH_M * 1000).astype(np.uint16))[1].tobytes()
    assert is_depth(compressed(grey, "png"))  # whatever the format says, nothing else has 16 bits of grey
    assert not is_depth(compressed(cv2.imencode(".png", RGB)[1].tobytes(), "png"))


def test_rvl_depth_is_the_depth_that_went_in():
    holes = np.rint(DEPTH_M * 1000).astype(np.uint16)
    holes[1, 2:5] = holes[4] = 0
    data = struct.pack("<iffII", 0, 0, 0, 7, 5) + rvl.encode(holes)
    np.testing.assert_allclose(depth_image(compressed(data, "16UC1; compressedDepth rvl")), holes / 1000, atol=1e-6)


def test_jpeg_and_png_whose_format_says_that_rgb_went_in_are_not_swapped():
    png = cv2.imencode(".png", RGB)[1].tobytes()  # OpenCV took it for BGR, so the file holds it swapped
    np.testing.assert_array_equal(color_image(compressed(png, "rgb8; png compressed rgb8")), RGB)


def test_a_last_row_without_its_padding_is_read():
    message = image(RGB, "rgb8", pad=3)
    message.data = message.data[:-3]
    np.testing.assert_array_equal(color_image(message), RGB)
