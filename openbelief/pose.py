"""Rigid transforms and planar poses (REP-103: x forward, y left, z up; REP-105 frame names)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array


@dataclass(frozen=True, slots=True)
class Pose2:
    """A planar pose in the map frame: metres, and radians counter-clockwise from map x."""

    x: float
    y: float
    yaw: float

    def __post_init__(self) -> None:
        if not np.all(np.isfinite([self.x, self.y, self.yaw])):
            raise ValueError(f"A pose must be finite, got x={self.x} y={self.y} yaw={self.yaw}.")

    @property
    def xy(self) -> Array:
        """(2,) float64, map frame, metres."""
        return np.array([self.x, self.y])

    def distance_to(self, other: Pose2) -> float:
        """Planar distance, metres."""
        return float(np.hypot(self.x - other.x, self.y - other.y))

    def matrix(self) -> Array:
        """(4, 4) float64 `T_map_base` of a body standing at this pose on the floor."""
        return transform([self.x, self.y, 0.0], quaternion_from_yaw(self.yaw))

    @classmethod
    def from_matrix(cls, T_map_base: Array) -> Pose2:
        """The planar part of a (4, 4) transform."""
        return cls(
            float(T_map_base[0, 3]), float(T_map_base[1, 3]), float(np.arctan2(T_map_base[1, 0], T_map_base[0, 0]))
        )


def wrap_angle(angle: float) -> float:
    """The same angle in [-pi, pi)."""
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


def quaternion_from_yaw(yaw: float) -> Array:
    """(4,) quaternion_xyzw of a rotation about z."""
    return np.array([0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)])


def quaternion_from_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """(4,) quaternion_xyzw of fixed-axis roll, pitch, yaw (URDF order)."""
    cr, sr, cp, sp, cy, sy = (f(a / 2) for a in (roll, pitch, yaw) for f in (np.cos, np.sin))
    return np.array(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
    )


def transform(translation: Array | list[float], quaternion_xyzw: Array | list[float]) -> Array:
    """(4, 4) float64 from metres and a quaternion; a non-finite or zero quaternion is refused."""
    t, q = np.asarray(translation, float), np.asarray(quaternion_xyzw, float)
    norm = np.linalg.norm(q)
    if not (np.isfinite(t).all() and np.isfinite(norm) and abs(norm - 1.0) < 1e-2):
        raise ValueError(f"Not a rigid transform: translation {t.tolist()}, quaternion_xyzw {q.tolist()}.")
    x, y, z, w = q / norm
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = t
    return T


def is_rigid(T: Array) -> bool:
    """Whether a (4, 4) matrix is a finite rotation, not a reflection, with a translation."""
    R = T[:3, :3]
    if not np.isfinite(T).all() or not np.array_equal(T[3], [0.0, 0.0, 0.0, 1.0]):
        return False
    return bool(np.abs(R @ R.T - np.eye(3)).max() < 1e-3 and np.linalg.det(R) > 0)


def quaternion_xyzw(T: Array) -> Array:
    """(4,) unit quaternion_xyzw (w >= 0) of a (4, 4) transform's rotation."""
    R = T[:3, :3]
    w2 = (1 + R[0, 0] + R[1, 1] + R[2, 2]) / 4
    K = np.array(
        [
            [R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
            [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
            [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], 0],
            [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], 4 * w2 - 1],
        ]
    )
    q = np.linalg.eigh(K / 3.0)[1][:, -1]
    return q if q[3] >= 0 else -q


def inverse(T: Array) -> Array:
    """(4, 4) inverse of a rigid transform."""
    R, t = T[:3, :3], T[:3, 3]
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = R.T, -R.T @ t
    return out


def apply(T_a_b: Array, points_b: Array) -> Array:
    """(n, 3) points of frame b, expressed in frame a."""
    return points_b @ T_a_b[:3, :3].T + T_a_b[:3, 3]


def interpolate(T0: Array, T1: Array, fraction: float) -> Array:
    """(4, 4) between two transforms: linear in translation, slerp in rotation; fraction in [0, 1]."""
    q0, q1 = quaternion_xyzw(T0), quaternion_xyzw(T1)
    cos = float(q0 @ q1)
    q1, cos = (-q1, -cos) if cos < 0 else (q1, cos)
    angle = np.arccos(min(cos, 1.0))
    if angle < 1e-6:
        q = (1 - fraction) * q0 + fraction * q1
    else:
        q = (np.sin((1 - fraction) * angle) * q0 + np.sin(fraction * angle) * q1) / np.sin(angle)
    return transform((1 - fraction) * T0[:3, 3] + fraction * T1[:3, 3], q / np.linalg.norm(q))


# REP-103: the optical frame looks along z with x right and y down; its parent looks along x.
T_CAMERA_LINK_OPTICAL = transform([0.0, 0.0, 0.0], [-0.5, 0.5, -0.5, 0.5])
