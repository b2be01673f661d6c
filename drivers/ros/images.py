"""ROS images to our arrays: colour to (h, w, 3) uint8 RGB, depth to (h, w) float32 metres with 0 = no measurement."""

from __future__ import annotations

import struct
from typing import Any

import cv2
import numpy as np

from drivers.ros import rvl
from drivers.ros.encodings import COLOR_ENCODINGS
from drivers.ros.image_size import JPEG, PNG, declared_size
from drivers.ros.refusals import ImageReason, ImageRefused
from openbelief.arrays import Array

IMAGE, COMPRESSED_IMAGE = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
DEPTH_TYPES = {"16UC1": "u2", "32FC1": "f4", "mono16": "u2"}
COMPRESSED_DEPTH_HEADER = struct.Struct("<iff")  # compressedDepth: format, quantisation A and B
RVL_SIZE = struct.Struct("<II")  # width and height, between that header and the stream
MAX_PIXELS = 1 << 26
PNG_KIND = slice(24, 26)  # bit depth and colour type
PNG_GRAY_16 = b"\x10\x00"


def is_depth(message: Any) -> bool:
    """Whether an Image or CompressedImage holds depth: its encoding or format says so, or it is a 16-bit grey PNG."""
    if message.__msgtype__ != COMPRESSED_IMAGE:
        return message.encoding in DEPTH_TYPES
    if "compressedDepth" in message.format or message.format.split(";")[0].strip() in DEPTH_TYPES:
        return True
    head = bytes(message.data[: PNG_KIND.stop])
    return head.startswith(PNG) and head[PNG_KIND] == PNG_GRAY_16


def color_image(message: Any) -> Array:
    """(h, w, 3) uint8 RGB of an Image (`COLOR_ENCODINGS`) or CompressedImage (jpeg, png).

    Raises ImageRefused.
    """
    if message.__msgtype__ == COMPRESSED_IMAGE:
        # image_transport says in which order it gave the channels to the compressor, which takes them for BGR
        order = cv2.IMREAD_COLOR_BGR if _order_of(message.format).startswith("rgb") else cv2.IMREAD_COLOR_RGB
        return _decompress(message.data, order, message.format, ImageReason.COLOR_ENCODING)
    encoding = COLOR_ENCODINGS.get(message.encoding)
    if encoding is None:
        known = ", ".join(COLOR_ENCODINGS)
        raise ImageRefused(ImageReason.COLOR_ENCODING, f"Colour is {message.encoding!r}; known are {known}.")
    if encoding.even and (message.width % 2 or message.height % 2):
        raise ImageRefused(
            ImageReason.MALFORMED, f"{message.encoding} of {message.width}x{message.height}: both should be even."
        )
    return encoding.to_rgb(_rows(message, encoding.dtype, encoding.channels, encoding.rows))


def depth_image(message: Any) -> Array:
    """(h, w) float32 metres, 0 = none, of an Image or CompressedImage (16UC1 millimetres, 32FC1 metres).

    Not finite and negative values become 0. Raises ImageRefused.
    """
    if message.__msgtype__ == COMPRESSED_IMAGE:
        return _compressed_depth(bytes(message.data), message.format)
    if message.encoding not in DEPTH_TYPES:
        known = ", ".join(DEPTH_TYPES)
        raise ImageRefused(ImageReason.DEPTH_ENCODING, f"Depth is {message.encoding!r}; known are {known}.")
    values = _rows(message, DEPTH_TYPES[message.encoding], 1)[:, :, 0]
    return _measured(values) if message.encoding == "32FC1" else _from_millimetres(values)


def fitted_depth(depth_m: Array, shape: tuple[int, int]) -> Array:
    """Depth of colour's view, resampled to its (height, width) by the nearest pixel. Raises ImageRefused.

    Only the same proportions are the same view.
    """
    (height, width), (h, w) = shape, depth_m.shape
    if height * w != width * h:
        raise ImageRefused(ImageReason.SIZES, f"Colour has {width}x{height} pixels, depth {w}x{h}: not one view.")
    return depth_m if (h, w) == shape else cv2.resize(depth_m, (width, height), interpolation=cv2.INTER_NEAREST)


def _order_of(description: str) -> str:
    """ "rgb8; jpeg compressed bgr8" -> "bgr8", what went into the compressor; "" where it is not said."""
    return description.rpartition("compressed")[2].strip() if "compressed" in description else ""


def _rows(message: Any, dtype: str, channels: int, halves: int = 2) -> Array:
    """(h, w, channels) of a raw image, honouring its byte order and the padding at the end of each row."""
    kind = np.dtype(dtype).newbyteorder(">" if message.is_bigendian else "<")
    height, width, step = int(message.height) * halves // 2, int(message.width), int(message.step)
    row = width * channels * kind.itemsize
    if not (0 < height * width <= MAX_PIXELS and step >= row and len(message.data) >= (height - 1) * step + row):
        raise ImageRefused(
            ImageReason.MALFORMED,
            f"{len(message.data)} bytes are not {height} rows of {step} with {width} {message.encoding} pixels.",
        )
    data = np.frombuffer(message.data, np.uint8)[: height * step]
    if len(data) < height * step:  # the last row may come without its padding
        data = np.concatenate((data, np.zeros(height * step - len(data), np.uint8)))
    rows = data.reshape(height, step)[:, :row]
    return np.ascontiguousarray(rows).view(kind).reshape(height, width, channels).astype(dtype, copy=False)


def _compressed_depth(data: bytes, description: str) -> Array:
    """(h, w) float32 metres from compressed_depth_image_transport's PNG or RVL, or from a plain 16-bit PNG."""
    start = data.find(PNG, 0, COMPRESSED_DEPTH_HEADER.size + len(PNG))
    if start in (0, COMPRESSED_DEPTH_HEADER.size):
        values = _decompress(data[start:], cv2.IMREAD_UNCHANGED, description, ImageReason.DEPTH_ENCODING)
        if values.ndim != 2 or values.dtype != np.uint16:
            raise ImageRefused(
                ImageReason.DEPTH_ENCODING, f"Compressed depth {description!r} is not one 16-bit channel."
            )
    elif "rvl" in description.lower():
        start, values = COMPRESSED_DEPTH_HEADER.size, _rvl(data[COMPRESSED_DEPTH_HEADER.size :], description)
    else:
        jpeg = data.startswith(JPEG)
        what = "is a JPEG, which has 8 bits and is lossy: depth needs 16-bit PNG" if jpeg else "holds no PNG"
        raise ImageRefused(ImageReason.DEPTH_ENCODING, f"Compressed depth {description!r} {what}.")
    if description.startswith("32FC1") and start:  # inverse depth, quantised: z = A / (value - B)
        _, a, b = COMPRESSED_DEPTH_HEADER.unpack_from(data)
        inverse_depth = np.where(values > 0, values - np.float32(b), np.inf)
        return _measured(np.divide(np.float32(a), inverse_depth, dtype=np.float32))
    return _from_millimetres(values)


def _rvl(data: bytes, description: str) -> Array:
    """(h, w) uint16."""
    try:
        width, height = RVL_SIZE.unpack_from(data)
        if not 0 < width * height <= MAX_PIXELS:
            raise rvl.RvlError(f"it says that it has {width}x{height} pixels")
        return rvl.decode(data[RVL_SIZE.size :], width * height).reshape(height, width)
    except (struct.error, rvl.RvlError) as error:
        raise ImageRefused(
            ImageReason.MALFORMED, f"{len(data)} bytes of {description!r} do not decode: {error}."
        ) from error


def _decompress(data: Any, flags: int, description: str, unknown: ImageReason) -> Array:
    """unknown: the reason where it is neither JPEG nor PNG, and does not claim to be."""
    encoded = np.frombuffer(data, np.uint8)
    head = encoded[: len(PNG)].tobytes()
    if not head.startswith((PNG, JPEG)) and not any(word in description.lower() for word in ("jpeg", "jpg", "png")):
        raise ImageRefused(unknown, f"{encoded.size} bytes of {description!r} are neither JPEG nor PNG.")
    image = None
    try:
        width, height = declared_size(encoded.tobytes())
        if width * height <= MAX_PIXELS:  # a small file may declare an image of gigabytes
            image = cv2.imdecode(encoded, flags)
    except (ValueError, cv2.error) as error:
        raise ImageRefused(
            ImageReason.MALFORMED, f"{encoded.size} bytes of {description!r} do not decode: {error}."
        ) from error
    if image is None:
        raise ImageRefused(ImageReason.MALFORMED, f"{encoded.size} bytes of {description!r} do not decode.")
    return image


def _from_millimetres(values: Array) -> Array:
    """Whole numbers from 0, of which each but 0 is a measurement."""
    depth_m: Array = values.astype(np.float32)
    depth_m /= np.float32(1000)
    return depth_m


def _measured(depth_m: Array) -> Array:
    """The same depth with 0 wherever there is no measurement (NaN, inf, negative)."""
    return np.where(np.isfinite(depth_m) & (depth_m > 0), depth_m, 0).astype(np.float32, copy=False)
