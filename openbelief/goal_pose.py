"""Where to stand to look at an object: the nearest collision-free boundary pose with expected visibility."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from openbelief.arrays import Array, points_array
from openbelief.observation import Intrinsics
from openbelief.parameters import Parameters
from openbelief.pose import Pose2
from openbelief.traversability import NoPath, OccupancyGrid, obstructed_m, way_out
from openbelief.visibility import SelfOcclusion, expected_visibility, thinned
from openbelief.walkable import Walkable
from openbelief.ways import ways

STANDOFF_MIN_M, STANDOFF_MAX_M = 0.5, 1.2  # from the object's boundary
ROBOT_RADIUS_M = 0.35  # a G1 with its arms swinging, and a margin
SPREAD_M = 0.5  # poses nearer to each other than this are one view
TILE_M = 0.15  # one cell is tried per tile at least this large: the view changes little within it
MAX_TRIED = 150  # and tiles grow around a large object, so that a search stays well under a second
SAME_WAY_M = 0.3  # ways that differ by less are equally long: the better view goes first
SIGHT_SLACK_M = 0.10  # where nothing is in plain sight: how much more may be in between than from the clearest place
SIGHT_LIMIT_M = 0.6  # half the table that a lamp stands on
SIGHT_NOISE_M = 0.07  # one cell: the rim of a thing that stands on the floor; a wall is two cells
RAISED_M = 0.3  # a thing whose lowest point is higher stands on something
MAX_POINTS = 250  # of the object, to judge one pose by


@dataclass(frozen=True, slots=True)
class GoalPose:
    """A place to look from. expected_visibility: nu it promises; path_length_m: the way there over free floor."""

    pose: Pose2
    expected_visibility: float
    path_length_m: float


@dataclass(frozen=True, slots=True)
class GoalSearch:
    """Poses, best first, views that differ; where there is none `reason` is a sentence for the operator.

    blind: then, the poses where the robot could still stand, those that show most of it first; for a person to decide.
    """

    poses: list[GoalPose]
    reason: str = ""
    blind: tuple[GoalPose, ...] = ()


class _Nowhere(Exception):
    """The search ended at this sentence."""


def goal_poses(
    points: Array,
    grid: OccupancyGrid,
    robot_pose: Pose2,
    T_base_camera: Array,
    intrinsics: Intrinsics,
    parameters: Parameters,
    limit: int = 4,
) -> GoalSearch:
    """Up to `limit` poses to look at an object from: free, reachable, in sight of it, expecting nu >= tau_nu.

    points: (n, 3), map frame, metres, floor at z = 0. grid: not inflated by us yet; its margins, if any, stay.
    T_base_camera: (4, 4), camera_*_optical_frame in base_link. Raises ValueError on misshapen or non-finite points.
    """
    cloud = points_array(points)
    try:
        cells, length_m = _reachable_boundary(cloud, grid, robot_pose)
        cells, length_m = _in_sight(cells, length_m, cloud, grid, float(T_base_camera[2, 3]))
    except _Nowhere as nowhere:
        return GoalSearch([], str(nowhere))
    judged: list[GoalPose] = []
    kept: list[GoalPose] = []
    for goals in _judged(cells, length_m, cloud, grid, T_base_camera, intrinsics, parameters):
        judged += goals
        good = [goal for goal in goals if goal.expected_visibility >= parameters.tau_nu]
        good.sort(key=lambda goal: (-goal.expected_visibility, goal.path_length_m))
        kept = _spread(kept + good, limit)
        if len(kept) == limit:
            break
    if kept:
        return GoalSearch(kept)
    judged.sort(key=lambda goal: (-round(goal.expected_visibility, 2), goal.path_length_m))
    reason = _unseeable(cloud, judged[0].expected_visibility, T_base_camera, intrinsics, parameters)
    return GoalSearch([], reason, blind=tuple(_spread(judged, limit)))


def _reachable_boundary(points: Array, grid: OccupancyGrid, robot: Pose2) -> tuple[Array, Array]:
    """((m, 2) cells, (m,) path lengths) at the right distance from the object's boundary, free and connected."""
    ring = _ring(points, grid)
    if not len(ring):
        raise _Nowhere("It is outside the map.")
    walkable = Walkable(grid, ROBOT_RADIUS_M)
    ring = ring[walkable.free(walkable.flat(ring))]
    if not len(ring):
        raise _Nowhere(
            f"There is no free floor {STANDOFF_MIN_M:.1f}-{STANDOFF_MAX_M:.1f} m from it "
            f"with {ROBOT_RADIUS_M:.2f} m of room for the robot."
        )
    start = grid.cell(robot.xy)
    if not grid.contains(start):
        raise _Nowhere(f"The robot at ({robot.x:.2f}, {robot.y:.2f}) is outside the map.")
    try:
        walkable.open(walkable.flat(way_out(grid, (int(start[0]), int(start[1])), ROBOT_RADIUS_M)))
    except NoPath as no_path:
        raise _Nowhere(str(no_path)) from None
    length_m = ways(walkable, start, ring) * grid.resolution_m
    reached = np.isfinite(length_m)
    if not reached.any():
        raise _Nowhere("There is no way to it over known free floor.")
    return _one_per_tile(ring[reached], length_m[reached], grid.resolution_m)


def _one_per_tile(cells: Array, length_m: Array, resolution_m: float) -> tuple[Array, Array]:
    """The nearest cell of every tile, nearest first."""
    tile_m = max(TILE_M, resolution_m * float(np.sqrt(len(cells) / MAX_TRIED)))
    order = np.argsort(length_m, kind="stable")
    tiles = (cells[order] * resolution_m / tile_m).astype(np.int64)
    chosen = order[np.sort(np.unique(tiles, axis=0, return_index=True)[1])]
    return cells[chosen], length_m[chosen]


def _ring(points: Array, grid: OccupancyGrid) -> Array:
    """(m, 2) cells whose centres are STANDOFF_MIN_M to STANDOFF_MAX_M from the nearest point, seen from above."""
    from scipy.spatial import cKDTree

    xy = points[:, :2].astype(np.float64)
    low = np.maximum(grid.cell(xy.min(axis=0) - STANDOFF_MAX_M), 0)
    high = np.minimum(grid.cell(xy.max(axis=0) + STANDOFF_MAX_M) + 1, grid.cells.shape)
    if (high <= low).any():
        return np.zeros((0, 2), np.int64)
    cells = np.stack(np.meshgrid(*map(np.arange, low, high), indexing="ij"), axis=-1).reshape(-1, 2)
    distance, _ = cKDTree(xy).query(grid.centre(cells))
    return cells[(distance >= STANDOFF_MIN_M) & (distance <= STANDOFF_MAX_M)]


def _in_sight(cells: Array, length_m: Array, points: Array, grid: OccupancyGrid, eye_m: float) -> tuple[Array, Array]:
    """The cells with a line of sight to the object's middle, or the clearest ones where none is free.

    Without heights the table under a lamp looks like a wall before it, so for a raised thing a little in between is
    forgiven, but only where no cell is in plain sight: else the robot might face the other side of a wall.
    """
    between = obstructed_m(grid, grid.centre(cells), eye_m, points)
    least = float(between.min())
    if least > (SIGHT_LIMIT_M if points[:, 2].min() > RAISED_M else SIGHT_NOISE_M):
        raise _Nowhere(f"Nothing around it has a line of sight to it: {least:.1f} m of obstacles lie in between.")
    keep = between <= (least + SIGHT_SLACK_M if least > 0 else 0.0)
    return cells[keep], length_m[keep]


def _judged(
    cells: Array,
    length_m: Array,
    points: Array,
    grid: OccupancyGrid,
    T_base_camera: Array,
    intrinsics: Intrinsics,
    parameters: Parameters,
) -> Iterator[list[GoalPose]]:
    """Each cell, nearest first, as a pose that faces the object's centroid, with the nu to expect there.

    Together come those that are equally far, when they are asked for: most searches end with the first few.
    """
    screen, sample = SelfOcclusion(points, parameters.voxel_m), thinned(points, MAX_POINTS)
    centroid = points.mean(axis=0, dtype=np.float64)
    for _, equally_far in groupby(
        zip(grid.centre(cells).tolist(), length_m.tolist(), strict=True), key=lambda each: int(each[1] / SAME_WAY_M)
    ):
        goals = []
        for (x, y), way_m in equally_far:
            pose = Pose2(x, y, float(np.arctan2(centroid[1] - y, centroid[0] - x)))
            nu = expected_visibility(sample, screen, pose.matrix() @ T_base_camera, intrinsics, parameters)
            goals.append(GoalPose(pose, nu, way_m))
        yield goals


def _spread(goals: list[GoalPose], limit: int) -> list[GoalPose]:
    """The first of every neighbourhood, in order."""
    kept: list[GoalPose] = []
    for goal in goals:
        if len(kept) < limit and all(goal.pose.distance_to(other.pose) >= SPREAD_M for other in kept):
            kept.append(goal)
    return kept


def seen_heights(T_base_camera: Array, intrinsics: Intrinsics, distance_m: float) -> tuple[float, float]:
    """(lowest, highest) metres above the floor that the image's middle column shows `distance_m` before the camera."""
    v = np.array([intrinsics.height - 0.5, -0.5])
    rays = np.column_stack((intrinsics.rays(np.full(2, intrinsics.cx), v), np.ones(2))) @ T_base_camera[:3, :3].T
    low, high = T_base_camera[2, 3] + distance_m * rays[:, 2] / np.hypot(rays[:, 0], rays[:, 1])
    return float(low), float(high)


def _unseeable(points: Array, best: float, T_base_camera: Array, intrinsics: Intrinsics, parameters: Parameters) -> str:
    low, high = seen_heights(T_base_camera, intrinsics, STANDOFF_MAX_M)
    z = points[:, 2]
    if z.min() > high:
        return (
            f"No pose can see it: its lowest point is {z.min():.1f} m up, "
            f"the camera sees nothing above {high:.2f} m at {STANDOFF_MAX_M:.1f} m."
        )
    return (
        f"No pose can see enough of it: {best:.0%} at best (needs {parameters.tau_nu:.0%}); it is {z.min():.1f}-"
        f"{z.max():.1f} m up, and at {STANDOFF_MAX_M:.1f} m the camera sees {max(low, 0.0):.2f}-{high:.2f} m."
    )
