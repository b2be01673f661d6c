"""What the benches work on, made from a seed: a site's observations, a frame full of masks, a floor of rooms."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array
from openbelief.g1 import COLOR_INTRINSICS
from openbelief.observation import Intrinsics, Mask, Observation, RgbdFrame
from openbelief.pose import Pose2, quaternion_from_rpy, transform
from openbelief.traversability import OCCUPIED, OccupancyGrid

VOXEL_M = 0.02
VIEWS = 40  # of each object
SPACING_M = 1.2  # between objects, which touch here and there
ROOM_M, DOOR_M, CELL_M = 8.0, 1.2, 0.05


def observations(count: int, seed: int = 0, dim: int = 64) -> list[Observation]:
    """Views of 500-2000 snapped points each; every object looks like one of a few classes."""
    rng = np.random.default_rng(seed)
    objects = -(-count // VIEWS)
    side = int(np.ceil(np.sqrt(objects)))
    classes = _unit(rng.normal(size=(max(objects // 4, 4), dim)))
    seen: list[Observation] = []
    for number in range(objects):
        at = np.round(np.array([number % side, number // side, 0]) * SPACING_M / VOXEL_M)
        voxels, look = _shell(rng) + at, classes[rng.integers(len(classes))]
        for _ in range(min(VIEWS, count - len(seen))):
            feature = _unit(look + rng.normal(size=dim) * 0.25 / np.sqrt(dim)).astype(np.float32)
            points = ((_view(rng, voxels) + 0.5) * VOXEL_M).astype(np.float32)
            seen.append(Observation(len(seen) // 5, len(seen) % 5, "thing", 0.9, points, feature))
    return seen


def _unit(rows: Array) -> Array:
    unit: Array = rows / np.linalg.norm(rows, axis=-1, keepdims=True)
    return unit


def _shell(rng: np.random.Generator) -> Array:
    """(n, 3) voxels of a box's or a ball's surface, 0.25-0.75 m in size."""
    sides = (rng.uniform(0.25, 0.75, 3) / VOXEL_M).astype(int)
    voxels = np.stack(np.meshgrid(*map(np.arange, sides), indexing="ij"), axis=-1).reshape(-1, 3)
    if rng.random() < 0.5:
        return voxels[((voxels == 0) | (voxels == sides - 1)).any(axis=1)]
    away = np.linalg.norm((voxels - (sides - 1) / 2) / (sides / 2), axis=1)
    return voxels[(away <= 1.05) & (away >= 1.05 - 2.2 / sides.min())]


def _view(rng: np.random.Generator, voxels: Array) -> Array:
    """The nearer 500-2000 voxels from some side, at times with the camera's pose a voxel off."""
    order = np.argsort(voxels @ rng.normal(size=3) + rng.normal(0, 2, len(voxels)))
    wanted = max(int(rng.uniform(500, 2000)), len(voxels) // 2)
    off = rng.integers(-1, 2, 3) * (rng.random() < 0.3)
    return voxels[order[: min(wanted, 2000)]] + off


def frame(masks: int = 20, seed: int = 0) -> tuple[RgbdFrame, list[Mask]]:
    """A 640x480 frame covered by masks in rows of five: slanted plates and balls 2-4.5 m away before a wall.

    Depth is noisy, has holes, and every mask bleeds two pixels onto the wall.
    """
    rng = np.random.default_rng(seed)
    height, width, wall_m = 480, 640, 5.0
    depth = np.full((height, width), wall_m)
    rows = -(-masks // 5)
    half = np.array([height / rows / 2, width / 10])
    made = []
    feature = np.eye(1, 64, dtype=np.float32)[0]
    for number in range(masks):
        middle = (np.array([number // 5, number % 5]) * 2 + 1) * half
        row, column = (np.mgrid[:height, :width] - middle[:, None, None] + 0.5) / half[:, None, None]
        away = np.maximum(abs(row), abs(column)) if number % 2 else np.hypot(row, column)
        slant = rng.uniform(-0.15, 0.15, 2)
        bulge = row * slant[0] + column * slant[1] if number % 2 else -0.2 * np.sqrt(np.clip(1 - away**2, 0, 1))
        depth = np.where(away <= 0.9, rng.uniform(2.0, 4.5) + bulge, depth)
        made.append(Mask(number, away <= 0.93, "thing", 0.9, feature))
    depth += rng.normal(0, 0.001, depth.shape) * depth**2
    depth[rng.random(depth.shape) < 0.01] = 0
    color = np.clip(rng.normal(128, 20, (height, width, 3)) + depth[..., None] * 20, 0, 255).astype(np.uint8)
    T_map_camera = transform([1.0, -2.0, 1.2], quaternion_from_rpy(-2.0, 0.1, 0.4))
    camera = Intrinsics(width, height, 600.0, 600.0, 319.5, 239.5)
    return RgbdFrame(0, 1, color, depth.astype(np.float32), camera, T_map_camera, "bench"), made


def floor(side_m: float, seed: int = 0, cut_m: float | None = None, door_at_end: bool = False) -> OccupancyGrid:
    """A square site of rooms with a door in every wall and furniture; about its middle a room's corner is the origin.

    cut_m: there a wall runs from end to end along y, without a door, or with one at its beginning.
    """
    rng = np.random.default_rng(seed)
    cells_a_side, room, door = (round(each / CELL_M) for each in (side_m, ROOM_M, DOOR_M))
    cells = np.zeros((cells_a_side, cells_a_side), np.int8)
    for row in range(0, cells_a_side, room):
        for column in range(0, cells_a_side, room):
            _furnish(cells[row : row + room, column : column + room], rng, door)
    cells[:3] = cells[-3:] = cells[:, :3] = cells[:, -3:] = OCCUPIED
    corner_m = -ROOM_M * (side_m // ROOM_M // 2)
    if cut_m is not None:
        column = round((cut_m - corner_m) / CELL_M)
        cells[:, column : column + 3] = OCCUPIED
        if door_at_end:
            cells[20 : 20 + door, column : column + 3] = 0
    return OccupancyGrid(cells, CELL_M, (corner_m, corner_m))


def _furnish(room: Array, rng: np.random.Generator, door: int) -> None:
    """Walls along the first row and column, a door in each, and four boxes away from the middle."""
    room[:3], room[:, :3] = OCCUPIED, OCCUPIED
    for wall in (room[:3], room[:, :3].T):
        at = int(rng.integers(door, max(wall.shape[1] - 2 * door, door + 1)))
        wall[:, at : at + door] = 0
    for _ in range(4):
        row, column = rng.integers(12, [max(room.shape[0] // 3, 13), max(room.shape[1] - 30, 13)])
        room[row : row + rng.integers(6, 20), column : column + rng.integers(6, 20)] = OCCUPIED


def thing(x: float, y: float) -> Array:
    """(n, 3) float32: the surface of a box of 0.4 x 0.4 x 0.5 m on the floor, as voxel centres."""
    voxels = np.stack(np.meshgrid(np.arange(20), np.arange(20), np.arange(25), indexing="ij"), axis=-1).reshape(-1, 3)
    surface = voxels[((voxels == 0) | (voxels == [19, 19, 24])).any(axis=1)]
    corner = np.round(np.array([x - 0.2, y - 0.2, 0.0]) / VOXEL_M)
    return ((surface + corner + 0.5) * VOXEL_M).astype(np.float32)


def middle_of_room(number: int) -> Pose2:
    """Of the rooms from the site's middle along x: furniture leaves a room's middle free."""
    return Pose2(ROOM_M * (number + 0.5), ROOM_M * 0.6, 0.0)


CAMERA = COLOR_INTRINSICS
