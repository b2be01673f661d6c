"""What mapping saw around the objects: where the camera stood, what it measured and saw there, and the maps.

None of it is evidence for an object, so no content hash covers it; floors, rooms and views are derived from it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np

from openbelief.arrays import Array, read_only
from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.traversability import OccupancyGrid

KEYFRAME_M, KEYFRAME_DEG = 0.25, 15.0  # a camera that moved and turned less shows the same again
DEPTH_STEP_PX = 4  # every fourth row and column of depth is kept: 3 cm at 4 m for a D435
PICTURE_MAX_PX, PICTURE_JPEG_QUALITY = 640, 80


@dataclass(frozen=True, eq=False)
class CameraView:
    """A keyframe. T_map_camera: (4, 4) float64, optical frame. intrinsics: of the picture's colour camera, undivided.

    Depth and picture are read when they are asked for: `Surroundings.depth_m`, `Surroundings.picture`.
    """

    recording: str
    stamp_ns: int
    T_map_camera: Array = field(repr=False)
    intrinsics: Intrinsics

    @property
    def key(self) -> tuple[str, int]:
        return self.recording, self.stamp_ns


@dataclass(frozen=True)
class StoreyMap:
    """A navigation map of a recording, and the height of its floor, z in the map frame, metres."""

    recording: str
    grid: OccupancyGrid
    height_m: float = 0.0


@dataclass(frozen=True)
class ViewImages:
    """depth_png: uint16 millimetres of every DEPTH_STEP_PX-th row and column, 0 = no measurement. picture_jpeg: RGB."""

    depth_png: bytes
    picture_jpeg: bytes


def _nothing(key: tuple[str, int]) -> ViewImages:
    raise KeyError(f"No picture of {key}.")


@dataclass(frozen=True)
class Surroundings:
    """views: by recording and stamp. maps: the newest of each recording and height. images: reads a view's own."""

    views: tuple[CameraView, ...] = ()
    maps: tuple[StoreyMap, ...] = ()
    images: Callable[[tuple[str, int]], ViewImages] = field(repr=False, default=_nothing)

    def depth_m(self, view: CameraView) -> tuple[Array, Intrinsics]:
        """(h, w) float32 metres along the optical axis, 0 = no measurement, and the camera that has those pixels."""
        return decode_depth(self.images(view.key).depth_png), thinned_camera(view.intrinsics)

    def picture(self, view: CameraView) -> bytes:
        """What it saw, JPEG, at most PICTURE_MAX_PX on its longer side."""
        return self.images(view.key).picture_jpeg


def is_keyframe(T_map_camera: Array, last_T_map_camera: Array | None) -> bool:
    """Has the camera moved or turned enough since the last one kept?"""
    if last_T_map_camera is None:
        return True
    moved = float(np.linalg.norm(T_map_camera[:3, 3] - last_T_map_camera[:3, 3]))
    cosine = (np.trace(T_map_camera[:3, :3].T @ last_T_map_camera[:3, :3]) - 1) / 2
    return moved >= KEYFRAME_M or bool(cosine <= np.cos(np.deg2rad(KEYFRAME_DEG)))


def view_of(frame: RgbdFrame) -> tuple[CameraView, ViewImages]:
    """A frame as a keyframe."""
    pose = read_only(np.array(frame.T_map_camera, dtype=np.float64))
    view = CameraView(frame.recording, frame.stamp_ns, pose, frame.intrinsics)
    return view, ViewImages(encode_depth(frame.depth_m), _encode_picture(frame.color))


def thinned_camera(camera: Intrinsics) -> Intrinsics:
    """The camera of every DEPTH_STEP_PX-th pixel, the first one included."""
    s = DEPTH_STEP_PX
    size = (-(-camera.width // s), -(-camera.height // s))
    return Intrinsics(*size, camera.fx / s, camera.fy / s, camera.cx / s, camera.cy / s, camera.distortion)


def encode_depth(depth_m: Array) -> bytes:
    millimetres = np.rint(depth_m[::DEPTH_STEP_PX, ::DEPTH_STEP_PX] * 1000.0)
    measured = (millimetres > 0) & (millimetres < 65536)  # NaN compares false
    return _encoded(".png", np.where(measured, millimetres, 0).astype(np.uint16))


def decode_depth(png: bytes) -> Array:
    """(h, w) float32 metres; raises ValueError on what is no such picture."""
    image = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED) if png else None
    if image is None or image.ndim != 2 or image.dtype != np.uint16:
        raise ValueError("A view's depth is not a 16-bit picture.")
    return image.astype(np.float32) / np.float32(1000.0)


def _encode_picture(color: Array) -> bytes:
    shrink = PICTURE_MAX_PX / max(color.shape[:2])
    if shrink < 1:
        color = cv2.resize(color, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
    bgr = cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2BGR)
    return _encoded(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, PICTURE_JPEG_QUALITY])


def _encoded(kind: str, image: Array, options: list[int] | None = None) -> bytes:
    return cv2.imencode(kind, image, options or [])[1].tobytes()
