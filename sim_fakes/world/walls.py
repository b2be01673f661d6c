"""Walls and floors from room polygons and door openings."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array
from sim_fakes.world.furniture import PALETTE
from sim_fakes.world.mesh import Mesh, box, painted
from sim_fakes.world.scene import Door, SceneError, SceneRoom

WALL_HEIGHT_M = 2.5
WALL_THICKNESS_M = 0.06  # each room brings its own half of the wall, on its own side
DOOR_HEIGHT_M = 2.05
SKIRTING_M = 0.09


def floor_mesh(rooms: list[SceneRoom]) -> Mesh:
    """Two triangles under the whole flat; the rooms' textures are painted on it by position."""
    corners = np.concatenate([np.array(room.polygon) for room in rooms])
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    vertices = np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]], dtype=float)
    return painted(vertices, np.array([[0, 1, 2], [0, 2, 3]]), np.array(PALETTE["beige"]), "floor")


def wall_meshes(rooms: list[SceneRoom], doors: list[Door]) -> list[Mesh]:
    """The inner skins of every room, with the doors cut out. Raises SceneError where a door meets no wall."""
    parts: list[Mesh] = []
    used: set[int] = set()
    for room in rooms:
        polygon = _counter_clockwise(np.array(room.polygon, dtype=float))
        for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            gaps = {i: gap for i, door in enumerate(doors) if (gap := _gap(start, end, door))}
            used |= gaps.keys()
            parts += _wall(start, end, sorted(gaps.values()), _pastel(PALETTE[room.wall]))
    if lost := [door for i, door in enumerate(doors) if i not in used]:
        raise SceneError(f"door at {list(lost[0].at)}: field 'at': no wall passes there")
    return parts


def _pastel(colour: tuple[float, float, float]) -> Array:
    """Wall paint is paler than furniture."""
    return 0.4 * np.array(colour) + 0.6 * np.array(PALETTE["white"])


def _counter_clockwise(polygon: Array) -> Array:
    x, y = polygon.T
    area = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    return polygon if area > 0 else polygon[::-1]


def _gap(start: Array, end: Array, door: Door) -> tuple[float, float] | None:
    """The (from, to) metres that a door takes out of a wall, None where it is on another wall."""
    along, length = (end - start) / np.linalg.norm(end - start), float(np.linalg.norm(end - start))
    offset = np.array(door.at) - start
    middle, aside = float(offset @ along), float(along[0] * offset[1] - along[1] * offset[0])
    on_wall = abs(aside) < 0.05 and door.width / 2 < middle < length - door.width / 2
    return (middle - door.width / 2, middle + door.width / 2) if on_wall else None


def _wall(start: Array, end: Array, gaps: list[tuple[float, float]], colour: Array) -> list[Mesh]:
    """Solid pieces between the gaps, a lintel over each."""
    direction, length = end - start, float(np.linalg.norm(end - start))
    position, yaw = np.array([*start, 0.0]), float(np.arctan2(direction[1], direction[0]))
    edges = [0.0, *(edge for gap in gaps for edge in gap), length]
    pieces = [(a, b, 0.0, WALL_HEIGHT_M) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    pieces += [(a, b, DOOR_HEIGHT_M, WALL_HEIGHT_M) for a, b in gaps]
    slabs = [box(np.array([a, 0, z0]), np.array([b, WALL_THICKNESS_M, z1]), colour, "wall") for a, b, z0, z1 in pieces]
    boards = [
        box(np.array([a, 0, 0]), np.array([b, WALL_THICKNESS_M + 0.012, SKIRTING_M]), np.array(PALETTE["white"]))
        for a, b, z0, _ in pieces
        if z0 == 0
    ]
    return [part.moved(position, yaw) for part in slabs + boards]
