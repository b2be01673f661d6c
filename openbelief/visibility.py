"""How much of a stored object an image shows, or a pose would show: nu (paper: Sec. III-F, first check)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from openbelief.arrays import Array
from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.pose import apply, inverse

DEPTH_TOLERANCE_M = 0.03
DEPTH_TOLERANCE_RATIO = 0.02  # of the distance: what a stereo camera's noise grows to
MAX_QUERIED = 5000  # a share is as good from every k-th point of a large object
MAX_VOXELS = 4_000_000


@dataclass(frozen=True, slots=True)
class Visibility:
    """Shares of the `expected` points: those the object does not hide from the viewpoint itself, in or out of view.

    nu + occluded + out_of_view + no_depth = 1 (all 0 where nothing is expected). see_through is part of nu: the camera
    measured something farther away, so it saw that the thing is not there.
    """

    expected: int
    nu: float
    occluded: float
    out_of_view: float
    no_depth: float
    see_through: float


class SelfOcclusion:
    """The object's own voxels, as a screen before its own points. points: (n, 3), map frame, metres."""

    def __init__(self, points: Array, voxel_m: float) -> None:
        extent = np.ptp(points, axis=0).astype(np.float64)
        while np.prod(extent / voxel_m + 3) > MAX_VOXELS:
            voxel_m *= 2
        self._voxel_m = voxel_m
        self._low = np.floor(points.min(axis=0).astype(np.float64) / voxel_m) - 1  # an empty border all round
        voxels = np.floor(points.astype(np.float64) / voxel_m - self._low).astype(np.int64)
        self._occupied = np.zeros(voxels.max(axis=0) + 2, bool)
        self._occupied[tuple(voxels.T)] = True

    def hides(self, points: Array, viewpoint: Array, tolerance_m: Array) -> Array:
        """(k,) bool: on the way to the viewpoint (3,) a point (k, 3) meets the object again past tolerance_m (k,)."""
        way = viewpoint - points.astype(np.float64)
        distance = np.linalg.norm(way, axis=1)
        direction = way / np.maximum(distance, 1e-9)[:, None]
        farthest = min(float(distance.max()), float(np.linalg.norm(self._occupied.shape)) * self._voxel_m)
        steps = np.arange(0.0, max(farthest - float(tolerance_m.min()), 0.0), self._voxel_m)
        along = tolerance_m[:, None] + steps
        met = along < distance[:, None]
        start = points / self._voxel_m - self._low
        voxel = [
            self._clipped(start[:, i, None] + along * (direction[:, i, None] / self._voxel_m), i) for i in range(3)
        ]
        return np.any(met & self._occupied[tuple(voxel)], axis=1)

    def _clipped(self, coordinate: Array, axis: int) -> Array:
        """Voxel numbers along an axis; what lies outside falls into the empty border."""
        return np.clip(coordinate, 0, self._occupied.shape[axis] - 1).astype(np.int32)


def visibility(points: Array, frame: RgbdFrame, parameters: Parameters, pose_error_m: float) -> Visibility:
    """nu of (n, 3) stored points, map frame, in a frame: visible is in the image, measured, and nothing nearer."""
    queried = thinned(points, MAX_QUERIED)
    in_camera = apply(inverse(frame.T_map_camera), queried.astype(np.float64))
    tolerance = depth_tolerance(in_camera, pose_error_m)
    screen = SelfOcclusion(points, parameters.voxel_m)
    expected = ~screen.hides(queried, frame.T_map_camera[:3, 3], tolerance)
    seen, column, row = in_image(in_camera[expected], frame.intrinsics)
    depth = np.where(seen, frame.depth_m[row, column], np.nan).astype(np.float64)
    measured = seen & np.isfinite(depth) & (depth >= parameters.depth_min_m)
    behind = np.where(measured, depth - in_camera[expected, 2], 0.0)  # > 0: measured behind the point
    nearer, farther = behind < -tolerance[expected], behind > tolerance[expected]
    return _shares(int(expected.sum()), measured & ~nearer, nearer, ~seen, seen & ~measured, farther)


def expected_visibility(
    points: Array, screen: SelfOcclusion, T_map_camera: Array, intrinsics: Intrinsics, parameters: Parameters
) -> float:
    """nu that a camera with a clear view would see from a pose: image bounds, depth range and the object itself count.

    points: (k, 3), map frame, thinned already; screen: of all the object's points.
    """
    in_camera = apply(inverse(T_map_camera), points.astype(np.float64))
    hidden = screen.hides(points, T_map_camera[:3, 3], depth_tolerance(in_camera, 0.0))
    seen, _, _ = in_image(in_camera, intrinsics)
    z = in_camera[:, 2]
    seen &= (z >= parameters.depth_min_m) & (z <= parameters.depth_max_m)
    return float((seen & ~hidden).sum() / max(int((~hidden).sum()), 1))


def depth_tolerance(points_camera: Array, pose_error_m: float) -> Array:
    """(n,) metres within which a measured depth agrees with the expected one."""
    return np.maximum(DEPTH_TOLERANCE_M, DEPTH_TOLERANCE_RATIO * np.abs(points_camera[:, 2])) + pose_error_m


def in_image(points_camera: Array, intrinsics: Intrinsics) -> tuple[Array, Array, Array]:
    """((n,) bool in the image, (n,) column, (n,) row) of (n, 3) points; column and row are 0 where not in the image."""
    low, high = _view_limits(intrinsics)
    z = points_camera[:, 2]
    rays = points_camera[:, :2] / np.where(z > 0, z, 1.0)[:, None]
    seen = (z > 0) & ((rays >= low) & (rays <= high)).all(axis=1)  # far outside, distortion folds points back in
    pixels = np.zeros((len(z), 2), np.int64)
    if seen.any():
        pixels[seen] = np.rint(intrinsics.project(points_camera[seen]))
    seen &= ((pixels >= 0) & (pixels < [intrinsics.width, intrinsics.height])).all(axis=1)
    pixels[~seen] = 0
    return seen, pixels[:, 0], pixels[:, 1]


def thinned(points: Array, limit: int) -> Array:
    """Every k-th of (n, 3) points, so that at most `limit` stay."""
    return points[:: max(1, -(-len(points) // limit))]


@lru_cache(maxsize=64)
def _view_limits(intrinsics: Intrinsics) -> tuple[Array, Array]:
    """(2,) lowest and (2,) highest normalised coordinates (x/z, y/z) on the image's border."""
    u, v = np.arange(intrinsics.width, dtype=float), np.arange(intrinsics.height, dtype=float)
    left, top = np.full(len(v), -0.5), np.full(len(u), -0.5)
    columns = np.concatenate((u, u, left, left + intrinsics.width))
    rows = np.concatenate((top, top + intrinsics.height, v, v))
    rays = intrinsics.rays(columns, rows)
    return rays.min(axis=0), rays.max(axis=0)


def _shares(
    expected: int, visible: Array, occluded: Array, out: Array, no_depth: Array, see_through: Array
) -> Visibility:
    nu, near, outside, unmeasured, through = (
        float(flags.sum() / max(expected, 1)) for flags in (visible, occluded, out, no_depth, see_through)
    )
    return Visibility(expected, nu, near, outside, unmeasured, through)
