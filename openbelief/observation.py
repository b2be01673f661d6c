"""What a frame and a mask are, and the observation made of them (paper: eq. observation)."""

from __future__ import annotations

import hashlib
import json
import numbers
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import cv2
import numpy as np

from openbelief.arrays import Array, points_array, read_only, unit_vector
from openbelief.run_lengths import Rle


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera with OpenCV distortion; pixel centres are at integer coordinates."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()  # OpenCV order k1 k2 p1 p2 [k3 ...] (ROS plumb_bob, rational_polynomial)

    def matrix(self) -> Array:
        """(3, 3) float64 K."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], dtype=float)

    def rays(self, u: Array, v: Array) -> Array:
        """(n, 2) normalised image coordinates (x/z, y/z) of n pixels (column u, row v), undistorted."""
        if not any(self.distortion):
            return np.column_stack(((u - self.cx) / self.fx, (v - self.cy) / self.fy))
        pixels = np.column_stack((u, v)).astype(np.float64)[:, None, :]
        return cv2.undistortPoints(pixels, self.matrix(), np.array(self.distortion))[:, 0, :]

    def project(self, points_camera: Array) -> Array:
        """(n, 2) pixel coordinates (u, v) of (n, 3) points in front of the camera (z > 0), optical frame."""
        points = np.asarray(points_camera, dtype=np.float64)
        if not any(self.distortion):
            return points[:, :2] / points[:, 2:3] * [self.fx, self.fy] + [self.cx, self.cy]
        pixels, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), self.matrix(), np.array(self.distortion))
        return pixels[:, 0, :]


@dataclass(frozen=True, eq=False)  # comparing arrays gives an array, so observations are compared by identity
class RgbdFrame:
    """One posed RGB-D image (I_t, D_t, T_t), depth aligned to colour.

    color: (h, w, 3) uint8 RGB. depth_m: (h, w) float32 metres along the optical axis, 0 = no measurement.
    T_map_camera: (4, 4) float64, `p_map = T_map_camera @ p_camera`, camera_*_optical_frame.
    """

    index: int
    stamp_ns: int
    color: Array = field(repr=False)
    depth_m: Array = field(repr=False)
    intrinsics: Intrinsics
    T_map_camera: Array = field(repr=False)
    recording: str = ""

    def __post_init__(self) -> None:
        shape = (self.intrinsics.height, self.intrinsics.width)
        if self.color.shape != (*shape, 3) or self.depth_m.shape != shape:
            raise ValueError(
                f"Frame {self.index}: colour {self.color.shape} and depth {self.depth_m.shape} "
                f"should be {shape}, as the intrinsics say."
            )
        if self.T_map_camera.shape != (4, 4) or not np.isfinite(self.T_map_camera).all():
            raise ValueError(f"Frame {self.index}: T_map_camera should be a finite (4, 4) transform.")


@dataclass(frozen=True, eq=False)  # comparing arrays gives an array, so observations are compared by identity
class Mask:
    """One segmented thing in a frame: where it is, what it was called, how sure, and what it looks like.

    pixels: (h, w) bool. phrase: the words that produced it, or None. confidence c_e in (0, 1].
    feature f_e^v: (d,) float32 unit length.
    """

    index: int
    pixels: Array = field(repr=False)
    phrase: str | None
    confidence: float
    feature: Array = field(repr=False)


@dataclass(frozen=True)
class Provenance:
    """Where an observation came from, kept so that a person can be shown it."""

    recording: str
    stamp_ns: int
    bbox: tuple[int, int, int, int]  # x0, y0, x1, y1; end exclusive
    rle: Rle
    crop_jpeg: bytes | None = field(default=None, repr=False)


@dataclass(frozen=True, eq=False)
class Observation:
    """o_e = (t_e, j_e, l_e, c_e, n_e, P_e, f_e^v) (paper: eq. observation): the unit of preserved evidence.

    frame: t_e, unique within a recording. mask: j_e. phrase: l_e as the model gave it; None is an observation
    without language. confidence: c_e in (0, 1]. points: P_e, (n, 3) float32, map frame, metres, taken as given.
    feature: f_e^v, (d,) float32 unit length. Both are its own, read-only: what the caller does to his arrays
    afterwards changes no evidence. Equal only to itself. Raises ValueError on what is none of these.
    """

    frame: int
    mask: int
    phrase: str | None
    confidence: float
    points: Array = field(repr=False)
    feature: Array = field(repr=False)
    provenance: Provenance | None = None

    def __post_init__(self) -> None:
        frame, mask = _index(self.frame, "Observation: frame"), _index(self.mask, "Observation: mask")
        name = f"Observation (frame {frame}, mask {mask})"
        own = {
            "frame": frame,
            "mask": mask,
            "confidence": _confidence(self.confidence, f"{name}: confidence"),
            "points": read_only(points_array(self.points, f"{name}: points")),
            "feature": read_only(unit_vector(self.feature, f"{name}: feature")),
        }
        if not isinstance(self.phrase, str | None):
            raise ValueError(f"{name}: phrase should be text or None, got {type(self.phrase).__name__}.")
        if not isinstance(self.provenance, Provenance | None):
            raise ValueError(
                f"{name}: provenance should be a Provenance or None, got {type(self.provenance).__name__}."
            )
        for field_name, value in own.items():
            object.__setattr__(self, field_name, value)

    @property
    def n(self) -> int:
        """n_e: the number of points."""
        return len(self.points)

    @property
    def recording(self) -> str:
        """The recording's id, "" where there is no provenance."""
        return self.provenance.recording if self.provenance else ""

    @property
    def key(self) -> tuple[str, int, int]:
        """(recording, frame, mask): the canonical order of evidence."""
        return (self.recording, self.frame, self.mask)

    @cached_property
    def digest(self) -> bytes:
        """32 bytes over everything it says: of what cannot change, taken once."""
        return digest(self)


def _index(value: Any, what: str) -> int:
    """A whole number from 0 as Python's own; raises ValueError naming `what`."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < 0:
        raise ValueError(f"{what} should be a whole number from 0, got {_short(value)}.")
    return int(value)


def _confidence(value: Any, what: str) -> float:
    """c_e in (0, 1] as Python's own; raises ValueError naming `what`."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real) or not 0.0 < float(value) <= 1.0:
        raise ValueError(f"{what} should be a number in (0, 1], got {_short(value)}.")
    return float(value)


def _short(value: Any) -> str:
    """What was given, on one line."""
    return repr(value)[:40] if isinstance(value, str | numbers.Number | None) else type(value).__name__


def digest(observation: Observation) -> bytes:
    """32 bytes that name it, over everything it says now. The JPEG crop is an illustration and stays outside."""
    source, recording = observation.provenance, observation.recording
    frame, mask, confidence = int(observation.frame), int(observation.mask), float(observation.confidence)
    said: list[Any] = [recording, frame, mask, observation.phrase, confidence.hex(), observation.n]
    if source:
        said += [int(source.stamp_ns), *(int(n) for n in (*source.bbox, *source.rle["size"]))]
    sha = hashlib.sha256(json.dumps(said).encode())
    if source:
        sha.update(np.ascontiguousarray(source.rle["counts"], dtype="<u4").data)
    sha.update(np.ascontiguousarray(observation.points, dtype="<f4").data)
    sha.update(np.ascontiguousarray(observation.feature, dtype="<f4").data)
    return sha.digest()
