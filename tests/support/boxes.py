"""Boxes on a floor: what mapping keeps of them, the grid they stand in, and the image that a camera takes, in numpy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from openbelief import g1
from openbelief.arrays import Array
from openbelief.memory import ObjectMemory
from openbelief.observation import Intrinsics, Observation
from openbelief.parameters import Parameters
from openbelief.perception.sentence import SentenceEncoder
from openbelief.pose import Pose2
from openbelief.traversability import FREE, OCCUPIED, OccupancyGrid

ENCODER = SentenceEncoder()
CAMERA_FRAME = "camera_color_optical_frame"
K = Intrinsics(160, 120, 154.3, 154.3, 79.5, 59.5)  # the G1's colour camera, a quarter of its pixels
SIDE_M, CELL_M = 8.0, 0.05


@dataclass(frozen=True)
class Box:
    """Something on the floor. mapped: what mapping called it, None = not in the memory. seen: what it is up close."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    mapped: str | None
    seen: str | None
    in_map: bool = True  # False: an obstacle that the grid does not know

    @property
    def centre(self) -> Array:
        return (np.array(self.low) + self.high) / 2


def box(x: float, y: float, mapped: str | None, seen: str | None, size: float = 0.4, z: float = 0.0, **more) -> Box:
    half = size / 2
    return Box((x - half, y - half, z), (x + half, y + half, z + size), mapped, seen, **more)


def surface(item: Box, step: float = 0.02) -> Array:
    """(n, 3) points on the faces that a walk around the box sees, at voxel centres."""
    low, high = np.array(item.low), np.array(item.high)
    axes = [np.arange(a + step / 2, b, step) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    edge = (np.abs(grid[:, :2] - low[:2]) < step).any(1) | (np.abs(grid[:, :2] - high[:2]) < step).any(1)
    return grid[edge | (np.abs(grid[:, 2] - high[2]) < step)].astype(np.float32)


def memory_of(boxes: list[Box], parameters: Parameters) -> ObjectMemory:
    observations = [
        Observation(frame, index, item.mapped, 0.9, surface(item), ENCODER.encode([item.mapped])[0])
        for frame in range(3)
        for index, item in enumerate(boxes)
        if item.mapped
    ]
    return ObjectMemory.build(observations, ENCODER, parameters)


def grid_of(boxes: list[Box]) -> OccupancyGrid:
    n = round(SIDE_M / CELL_M)
    cells = np.full((n, n), FREE, np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = OCCUPIED, OCCUPIED
    for item in (b for b in boxes if b.in_map):
        low, high = (np.floor(np.array(corner[:2]) / CELL_M).astype(int) for corner in (item.low, item.high))
        cells[low[1] : high[1], low[0] : high[0]] = OCCUPIED
    return OccupancyGrid(cells, CELL_M, (0.0, 0.0))


def render(boxes: list[Box], robot: Pose2) -> tuple[Array, Array]:
    """((h, w) float32 depth, (h, w) int instance, -1 = floor or nothing): rays against slabs."""
    T = robot.matrix() @ g1.T_BASE_CAMERA
    v, u = np.mgrid[0 : K.height, 0 : K.width]
    rays = np.column_stack((K.rays(u.ravel(), v.ravel()), np.ones(u.size))) @ T[:3, :3].T  # z = 1: t is depth
    eye = T[:3, 3]
    depth = np.where(rays[:, 2] < -1e-9, -eye[2] / np.minimum(rays[:, 2], -1e-9), 0.0)
    ids = np.full(len(rays), -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        for index, item in enumerate(boxes):
            a, b = (np.array(item.low) - eye) / rays, (np.array(item.high) - eye) / rays
            near, far = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
            hit = (near < far) & (near > 0.05) & ((depth == 0) | (near < depth))
            depth[hit], ids[hit] = near[hit], index
    return depth.reshape(v.shape).astype(np.float32), ids.reshape(v.shape)
