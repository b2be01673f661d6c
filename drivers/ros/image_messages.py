"""Images and their calibration as ROS messages; the RGB-D frame of three such messages (images.py reads the pixels)."""

from __future__ import annotations

import cv2
import numpy as np

from drivers.ports import CameraFrame
from drivers.ros.calibration import described
from drivers.ros.calibration import intrinsics as intrinsics_of
from drivers.ros.images import COMPRESSED_DEPTH_HEADER, color_image, depth_image, fitted_depth
from drivers.ros.messages import Message, WireError, header, make, stamp_to_ns
from drivers.ros.refusals import ImageRefused
from openbelief.arrays import Array
from openbelief.observation import Intrinsics

JPEG_QUALITY = 92


def camera_frame_of(
    color: Message, depth: Message, info: Message, *, rectified: bool = False, apart_ns: int = 0
) -> CameraFrame:
    """CameraFrame of one colour image (raw or compressed), its aligned depth and the camera's calibration.

    apart_ns: how far the stamps of colour and depth may differ; the colour's counts. The calibration is no measurement:
    its stamp does not count at all. Raises ImageRefused where an image cannot be used, WireError where the three do not
    belong together.
    """
    stamps = [stamp_to_ns(m.header.stamp) for m in (color, depth)]
    if abs(stamps[0] - stamps[1]) > apart_ns:
        raise WireError(f"Colour and depth of one frame should have one stamp, got {stamps}.")
    pixels, depth_m, intrinsics = color_image(color), depth_image(depth), intrinsics_of(info, rectified=rectified)
    shape = (intrinsics.height, intrinsics.width)
    if pixels.shape[:2] != shape:
        raise WireError(f"Colour {pixels.shape[:2]} should be {shape}, as the calibration says ({described(info)}).")
    try:
        depth_m = fitted_depth(depth_m, shape)
    except ImageRefused as refused:
        raise WireError(f"{refused} Publish depth aligned to colour.") from refused
    return CameraFrame(stamps[0], pixels, depth_m, intrinsics, color.header.frame_id)


def color_message(stamp_ns: int, frame_id: str, color: Array) -> Message:
    """sensor_msgs/Image rgb8 of (h, w, 3) uint8 RGB."""
    return _image(stamp_ns, frame_id, "rgb8", np.asarray(color, np.uint8))


def depth_message(stamp_ns: int, frame_id: str, depth_m: Array) -> Message:
    """sensor_msgs/Image 16UC1 (millimetres, as the RealSense node sends it) of (h, w) metres."""
    millimetres = np.clip(np.rint(np.asarray(depth_m, np.float64) * 1000), 0, 65535).astype("<u2")
    return _image(stamp_ns, frame_id, "16UC1", millimetres)


def jpeg_message(stamp_ns: int, frame_id: str, color: Array) -> Message:
    """sensor_msgs/CompressedImage of (h, w, 3) uint8 RGB."""
    ok, data = cv2.imencode(".jpg", cv2.cvtColor(color, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if not ok:
        raise WireError(f"An image of shape {color.shape} cannot be encoded as JPEG.")
    form = "rgb8; jpeg compressed bgr8"  # what image_transport writes
    return make("sensor_msgs/msg/CompressedImage", header=header(stamp_ns, frame_id), format=form, data=data.ravel())


def depth_png_message(stamp_ns: int, frame_id: str, depth_m: Array) -> Message:
    """sensor_msgs/CompressedImage of (h, w) metres: compressed_depth_image_transport's PNG of whole millimetres."""
    millimetres = np.clip(np.rint(np.asarray(depth_m, np.float64) * 1000), 0, 65535).astype(np.uint16)
    ok, png = cv2.imencode(".png", millimetres, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    if not ok:
        raise WireError(f"A depth image of shape {millimetres.shape} cannot be encoded as PNG.")
    data = np.concatenate((np.frombuffer(COMPRESSED_DEPTH_HEADER.pack(0, 0.0, 0.0), np.uint8), png.ravel()))
    form = "16UC1; compressedDepth png"
    return make("sensor_msgs/msg/CompressedImage", header=header(stamp_ns, frame_id), format=form, data=data)


def _image(stamp_ns: int, frame_id: str, encoding: str, pixels: Array) -> Message:
    data = np.ascontiguousarray(pixels).view(np.uint8).ravel()
    return make(
        "sensor_msgs/msg/Image",
        header=header(stamp_ns, frame_id),
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        step=data.size // pixels.shape[0],
        data=data,
    )


def camera_info_message(stamp_ns: int, frame_id: str, intrinsics: Intrinsics) -> Message:
    """sensor_msgs/CameraInfo."""
    i, d = intrinsics, np.zeros(8 if len(intrinsics.distortion) > 5 else 5)
    d[: len(i.distortion)] = i.distortion
    return make(
        "sensor_msgs/msg/CameraInfo",
        header=header(stamp_ns, frame_id),
        height=i.height,
        width=i.width,
        distortion_model="rational_polynomial" if len(d) == 8 else "plumb_bob",
        d=d,
        k=i.matrix().ravel(),
        r=np.eye(3).ravel(),
        p=np.array([i.fx, 0, i.cx, 0, 0, i.fy, i.cy, 0, 0, 0, 1, 0], dtype=float),
    )
