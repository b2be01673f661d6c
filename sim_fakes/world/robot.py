"""The simulated robot: planar kinematics along a polyline, with the G1's sensors on its head."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from drivers.clock import SimClock
from openbelief.arrays import Array
from openbelief.g1 import BODY_RADIUS_M, COLOR_INTRINSICS, T_BASE_CAMERA, T_BASE_LIDAR
from openbelief.polyline import arc_length, at_distances
from openbelief.pose import Pose2, wrap_angle
from openbelief.traversability import OCCUPIED, OccupancyGrid

SPEED_MAX = 0.5  # m/s
TURN_MAX = 1.0  # rad/s
ACCELERATION = 0.8  # m/s^2
TURN_GAIN = 3.0  # 1/s, heading error to turn rate
LOOKAHEAD_M = 0.25
REACHED_M = 0.03
FACING_RAD = 0.02
TURN_FIRST_RAD = 0.5  # stand and turn while the way ahead is further off than this
STEP_S = 0.02


class Ground(Protocol):
    """What the robot needs of the world: the floor it walks on."""

    def occupancy_grid(self) -> OccupancyGrid: ...


@dataclass(frozen=True)
class LocalisationError:
    """What localisation adds to the true pose: a slow, bounded, seeded wander."""

    position_m: float
    yaw_rad: float
    seed: int = 0

    def at(self, travelled_m: float) -> Array:
        """(3,) error in x, y (metres) and yaw (radians) after that much way."""
        rng = np.random.default_rng([self.seed, 0x10CA])
        phases, lengths = rng.uniform(0, 2 * np.pi, 3), rng.uniform(6.0, 12.0, 3)
        scale = np.array([self.position_m, self.position_m, self.yaw_rad])
        return scale * np.sin(phases + 2 * np.pi * travelled_m / lengths)


class SimRobot:
    """A G1 as a planar pose that follows a path while its clock sleeps. Any thread may call every method.

    pose: the true one; `believed_pose` is what localisation reports (the same where there is no error).
    """

    T_base_camera: Array = T_BASE_CAMERA
    T_base_lidar: Array = T_BASE_LIDAR
    intrinsics = COLOR_INTRINSICS

    def __init__(
        self, world: Ground, clock: SimClock, pose: Pose2, localisation_error: LocalisationError | None = None
    ) -> None:
        self._clearance = Clearance(world.occupancy_grid())
        self._require_room(pose)
        self._lock = threading.RLock()
        self._pose, self._speed, self._travelled = pose, 0.0, 0.0
        self._route: Route | None = None
        self._blocked: str | None = None
        self._error = localisation_error
        clock.every(STEP_S, self.step)

    @property
    def pose(self) -> Pose2:
        """T_map_base_link, planar, as it truly is."""
        with self._lock:
            return self._pose

    @property
    def believed_pose(self) -> Pose2:
        """T_map_base_link, planar, as localisation reports it."""
        with self._lock:
            if self._error is None:
                return self._pose
            dx, dy, dyaw = self._error.at(self._travelled)
            return Pose2(self._pose.x + dx, self._pose.y + dy, wrap_angle(self._pose.yaw + dyaw))

    @property
    def moving(self) -> bool:
        """True from `follow` until the pose is reached, the robot is blocked or it is halted."""
        with self._lock:
            return self._route is not None

    @property
    def blocked(self) -> str | None:
        """Why the last path was given up, None where it was not."""
        with self._lock:
            return self._blocked

    @property
    def speed(self) -> float:
        """Forward speed, m/s."""
        with self._lock:
            return self._speed

    def T_map_camera(self) -> Array:
        """(4, 4) of the true colour camera, optical frame."""
        return self.pose.matrix() @ self.T_base_camera

    def T_map_lidar(self) -> Array:
        """(4, 4) of the true lidar, livox_frame."""
        return self.pose.matrix() @ self.T_base_lidar

    def follow(self, path_xy: Array, final_yaw: float) -> None:
        """Walk the (n, 2) polyline in the map frame, metres, then turn to `final_yaw`. Replaces what is under way."""
        path = np.asarray(path_xy, dtype=float)
        if path.ndim != 2 or path.shape[1] != 2 or len(path) == 0 or not np.isfinite([*path.ravel(), final_yaw]).all():
            raise ValueError(f"Shape of path_xy should be (n, 2) with n >= 1 and finite values, got {path.shape}.")
        with self._lock:
            self._route, self._blocked = Route(np.vstack((self._pose.xy, path)), final_yaw), None

    def place(self, pose: Pose2) -> None:
        """Somebody carries it there, where it stands. Raises ValueError where it does not fit."""
        self._require_room(pose)
        with self._lock:
            self.halt()
            self._pose = pose

    def halt(self) -> None:
        """Stop where it stands."""
        with self._lock:
            self._route, self._speed = None, 0.0

    def _require_room(self, pose: Pose2) -> None:
        if self._clearance.at(pose.x, pose.y) < BODY_RADIUS_M:
            raise ValueError(f"The robot does not fit at x={pose.x:.2f} y={pose.y:.2f}: an obstacle is too near.")

    def step(self) -> None:
        """Move by one period of 0.02 s."""
        with self._lock:
            if self._route is None:
                return
            target, remaining = self._route.advance(self._pose.xy)
            if remaining <= REACHED_M:
                self._turn_to(self._route.final_yaw)
            else:
                self._advance(target, remaining)

    def _turn_to(self, yaw: float) -> None:
        self._speed = 0.0
        error = wrap_angle(yaw - self._pose.yaw)
        self._pose = self._turned(error)
        if abs(error) < FACING_RAD:
            self._route = None

    def _advance(self, target: Array, remaining: float) -> None:
        offset = target - self._pose.xy
        error = wrap_angle(float(np.arctan2(offset[1], offset[0])) - self._pose.yaw)
        wanted = 0.0 if abs(error) > TURN_FIRST_RAD else SPEED_MAX * np.cos(2 * error)
        braking = np.sqrt(2 * ACCELERATION * remaining)  # the fastest that still stops in time
        self._speed = float(min(wanted, braking, self._speed + ACCELERATION * STEP_S))
        turned = self._turned(error)
        step_m = float(min(self._speed * STEP_S, remaining))
        x, y = turned.x + step_m * math.cos(turned.yaw), turned.y + step_m * math.sin(turned.yaw)
        self._move_to(Pose2(x, y, turned.yaw), step_m)

    def _turned(self, error: float) -> Pose2:
        rate = float(np.clip(TURN_GAIN * error, -TURN_MAX, TURN_MAX))
        step = float(np.clip(rate * STEP_S, -abs(error), abs(error)))
        return Pose2(self._pose.x, self._pose.y, wrap_angle(self._pose.yaw + step))

    def _move_to(self, pose: Pose2, step_m: float) -> None:
        ahead, here = self._clearance.at(pose.x, pose.y), self._clearance.at(self._pose.x, self._pose.y)
        if ahead < BODY_RADIUS_M and ahead < here:
            self._blocked = f"An obstacle is {ahead:.2f} m from the robot's middle at x={pose.x:.2f} y={pose.y:.2f}."
            self.halt()
            return
        self._pose = pose
        self._travelled += step_m


class Clearance:
    """Distance to the nearest cell where the robot cannot stand, looked up on a grid."""

    def __init__(self, grid: OccupancyGrid) -> None:
        from scipy.ndimage import distance_transform_edt

        self._grid = grid
        self._metres = distance_transform_edt((grid.cells != OCCUPIED) & (grid.cells >= 0)) * grid.resolution_m

    def at(self, x: float, y: float) -> float:
        """Metres; 0 outside the grid."""
        column, row = np.floor((np.array([x, y]) - self._grid.origin_xy) / self._grid.resolution_m).astype(int)
        inside = 0 <= row < self._metres.shape[0] and 0 <= column < self._metres.shape[1]
        return float(self._metres[row, column]) if inside else 0.0


class Route:
    """A polyline being walked, and how far along it the robot is (so that a path may cross itself)."""

    def __init__(self, path_xy: Array, final_yaw: float) -> None:
        self._points = path_xy[np.diff(arc_length(path_xy), prepend=-1.0) > 1e-6]
        self._travelled = arc_length(self._points)
        self._along = 0.0
        self.final_yaw = final_yaw

    def at(self, along_m: Array | float) -> Array:
        """(..., 2) the points that far along, clamped to the end."""
        return at_distances(self._points, self._travelled, along_m)

    def advance(self, xy: Array) -> tuple[Array, float]:
        """The point to walk towards from `xy`, and the metres left."""
        ahead = np.arange(self._along, min(self._along + 2 * LOOKAHEAD_M, self._travelled[-1]) + 1e-9, 0.01)
        self._along = float(ahead[np.argmin(np.linalg.norm(self.at(ahead) - xy, axis=1))])
        left = self._travelled[-1] - self._along
        end = float(np.linalg.norm(self._points[-1] - xy))
        return self.at(self._along + LOOKAHEAD_M), end if left < LOOKAHEAD_M else float(left)
