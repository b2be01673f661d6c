"""ROS images to our arrays: colour to (h, w, 3) uint8 RGB, depth to (h, w) float32 metres with 0 = no measurement."""

from __future__ import annotations

import struct
from typing import Any

import cv2
import numpy as np

from drivers.ros.image_size import declared_size
from openbelief.arrays import Array
from openbelief.observation import Intrinsics

IMAGE, COMPRESSED_IMAGE = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
CHANNELS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1}
TO_RGB = {
    "bgr8": cv2.COLOR_BGR2RGB,
    "rgba8": cv2.COLOR_RGBA2RGB,
    "bgra8": cv2.COLOR_BGRA2RGB,
    "mono8": cv2.COLOR_GRAY2RGB,
}
DEPTH_TYPES = {"16UC1": "u2", "32FC1": "f4", "mono16": "u2"}
PNG = b"\x89PNG\r\n\x1a\n"
COMPRESSED_DEPTH_HEADER = struct.Struct("<iff")  # compressedDepth: format, quantisation A and B
DISTORTION_MODELS = ("", "plumb_bob", "rational_polynomial")
DISTORTION_LENGTHS = (0, 4, 5, 8, 12, 14)  # what OpenCV takes
MAX_PIXELS = 1 << 26


class ImageRefused(ValueError):
    """An image or a calibration cannot be used. `reason` is short and the same for all of its kind."""

    def __init__(self, reason: str, detail: str) -> None:
        super().__init__(detail)
        self.reason = reason


def is_depth(message: Any) -> bool:
    """Whether an Image or CompressedImage says that it holds depth."""
    if message.__msgtype__ == COMPRESSED_IMAGE:
        return "compressedDepth" in message.format or message.format.split(";")[0].strip() in DEPTH_TYPES
    return message.encoding in DEPTH_TYPES


def color_image(message: Any) -> Array:
    """(h, w, 3) uint8 RGB of an Image (rgb8, bgr8, rgba8, bgra8, mono8) or CompressedImage (jpeg, png).

    Raises ImageRefused.
    """
    if message.__msgtype__ == COMPRESSED_IMAGE:
        return cv2.cvtColor(_decompress(message.data, cv2.IMREAD_COLOR, message.format), cv2.COLOR_BGR2RGB)
    if message.encoding not in CHANNELS:
        known = ", ".join(CHANNELS)
        raise ImageRefused("colour encoding not supported", f"Colour is {message.encoding!r}; known are {known}.")
    pixels = _rows(message, "u1", CHANNELS[message.encoding])
    return cv2.cvtColor(pixels, TO_RGB[message.encoding]) if message.encoding in TO_RGB else pixels


def depth_image(message: Any) -> Array:
    """(h, w) float32 metres, 0 = none, of an Image or CompressedImage (16UC1 millimetres, 32FC1 metres).

    Not finite and negative values become 0. Raises ImageRefused.
    """
    if message.__msgtype__ == COMPRESSED_IMAGE:
        return _measured(_compressed_depth(bytes(message.data), message.format))
    if message.encoding not in DEPTH_TYPES:
        known = ", ".join(DEPTH_TYPES)
        raise ImageRefused("depth encoding not supported", f"Depth is {message.encoding!r}; known are {known}.")
    values = _rows(message, DEPTH_TYPES[message.encoding], 1)[:, :, 0]
    return _measured(values if message.encoding == "32FC1" else values.astype(np.float32) / np.float32(1000))


def intrinsics(message: Any) -> Intrinsics:
    """The camera of a CameraInfo (its K and D: the raw image); raises ImageRefused where it is no calibration."""
    k, d = np.asarray(message.k, float), np.asarray(message.d, float)
    if not (np.isfinite(k).all() and np.isfinite(d).all() and k[0] > 0 and k[4] > 0):
        raise ImageRefused("camera info is not a calibration", f"CameraInfo K {k.tolist()} and D {d.tolist()}.")
    if d.any() and (message.distortion_model not in DISTORTION_MODELS or len(d) not in DISTORTION_LENGTHS):
        known = f"{len(d)} coefficients of {message.distortion_model!r}"
        raise ImageRefused("distortion model not supported", f"CameraInfo has {known}; record a rectified image.")
    distortion = tuple(d.tolist()) if d.any() else ()
    return Intrinsics(int(message.width), int(message.height), k[0], k[4], k[2], k[5], distortion)


def _rows(message: Any, dtype: str, channels: int) -> Array:
    """(h, w, channels) of a raw image, honouring its byte order and the padding at the end of each row."""
    kind = np.dtype(dtype).newbyteorder(">" if message.is_bigendian else "<")
    height, width, step = int(message.height), int(message.width), int(message.step)
    row = width * channels * kind.itemsize
    if not (0 < height * width <= MAX_PIXELS and step >= row and len(message.data) >= height * step):
        raise ImageRefused(
            "image is malformed",
            f"{len(message.data)} bytes are not {height} rows of {step} with {width} {message.encoding} pixels.",
        )
    rows = np.frombuffer(message.data, np.uint8)[: height * step].reshape(height, step)[:, :row]
    return np.ascontiguousarray(rows).view(kind).reshape(height, width, channels).astype(dtype, copy=False)


def _compressed_depth(data: bytes, description: str) -> Array:
    """(h, w) float32 metres from compressed_depth_image_transport's PNG, or from a plain 16-bit PNG."""
    start = data.find(PNG, 0, COMPRESSED_DEPTH_HEADER.size + len(PNG))
    if start not in (0, COMPRESSED_DEPTH_HEADER.size):
        raise ImageRefused("depth encoding not supported", f"Compressed depth {description!r} holds no PNG.")
    values = _decompress(data[start:], cv2.IMREAD_UNCHANGED, description)
    if values.ndim != 2 or values.dtype != np.uint16:
        raise ImageRefused(
            "depth encoding not supported", f"Compressed depth {description!r} is not one 16-bit channel."
        )
    if description.startswith("32FC1") and start:  # inverse depth, quantised: z = A / (value - B)
        _, a, b = COMPRESSED_DEPTH_HEADER.unpack_from(data)
        inverse_depth = np.where(values > 0, values - np.float32(b), np.inf)
        return np.divide(np.float32(a), inverse_depth, dtype=np.float32)
    return values.astype(np.float32) / np.float32(1000)


def _decompress(data: Any, flags: int, description: str) -> Array:
    encoded = np.frombuffer(data, np.uint8)
    image = None
    try:
        width, height = declared_size(encoded.tobytes())
        if width * height <= MAX_PIXELS:  # a small file may declare an image of gigabytes
            image = cv2.imdecode(encoded, flags)
    except (ValueError, cv2.error) as error:
        raise ImageRefused(
            "image is malformed", f"{encoded.size} bytes of {description!r} do not decode: {error}."
        ) from error
    if image is None:
        raise ImageRefused("image is malformed", f"{encoded.size} bytes of {description!r} do not decode.")
    return image


def _measured(depth_m: Array) -> Array:
    """The same depth with 0 wherever there is no measurement (NaN, inf, negative)."""
    return np.where(np.isfinite(depth_m) & (depth_m > 0), depth_m, 0).astype(np.float32)
