"""Paint and light: two soft lights, contact shade near the floor, and textures that follow from position alone."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array
from openbelief.polygon import inside
from sim_fakes.world.furniture import PALETTE
from sim_fakes.world.mesh import MATERIALS, Mesh
from sim_fakes.world.world import World

TEXEL_M = 0.01
LIGHTS = ((np.array([0.35, -0.45, 0.82]), 0.42), (np.array([-0.6, 0.5, 0.62]), 0.22))  # direction, strength
AMBIENT_SKY, AMBIENT_GROUND = 0.52, 0.30
SHADE_HEIGHT_M = 0.35  # contact shade fades out over this height
GREYS = 4095  # steps of brightness before the display curve; a table is five times quicker than a power
BRIGHTNESS = ((np.arange(GREYS + 1) / GREYS) ** 0.85 * 255).astype(np.uint8)
FLOORS = {"planks": "wood", "parquet": "brown", "tiles": "beige", "carpet": "grey"}


class Shading:
    """Colours of hit points. All meshes' triangles are numbered through in the order given."""

    def __init__(self, world: World, meshes: list[Mesh]) -> None:
        self._normals = np.concatenate([m.normals for m in meshes]).astype(np.float32)
        self._colours = np.concatenate([m.colours for m in meshes]).astype(np.float32)
        self._materials = np.concatenate([m.materials for m in meshes])
        self._low, self._floor = floor_texture(world)
        self._shade = contact_shade(world, self._low, self._floor.shape[:2])

    def colours(self, points: Array, triangles: Array, uvs: Array) -> Array:
        """(n, 3) uint8 of (n, 3) map points on those triangles at those barycentric (n, 2) coordinates."""
        albedo = self._colours[triangles].copy()
        material = self._materials[triangles]
        points = points.astype(np.float32)
        row, column = self._texel(points)
        for index, name in enumerate(MATERIALS):
            here = np.flatnonzero(material == index)
            if not len(here):
                continue
            if name == "floor":
                albedo[here] = self._floor[row[here], column[here]]
            elif name in TEXTURES:
                albedo[here] *= TEXTURES[name](points[here])[:, None]
        corners = self._normals[triangles]
        u, v = uvs[:, :1], uvs[:, 1:]
        normals = (1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
        light = lighting(normals) * self._contact(points[:, 2], row, column)
        return BRIGHTNESS[(np.clip(albedo * light[:, None], 0, 1) * np.float32(GREYS)).astype(np.uint16)]

    def _contact(self, height: Array, row: Array, column: Array) -> Array:
        fade = np.clip(1 - height / SHADE_HEIGHT_M, 0, 1)
        return 1 - self._shade[row, column] * fade

    def _texel(self, points: Array) -> tuple[Array, Array]:
        column, row = ((points[:, :2] - self._low) / TEXEL_M).astype(np.int32).T
        return np.clip(row, 0, self._floor.shape[0] - 1), np.clip(column, 0, self._floor.shape[1] - 1)


def lighting(normals: Array) -> Array:
    """(n,) brightness: sky above, floor below, two directional lights."""
    light = AMBIENT_GROUND + (AMBIENT_SKY - AMBIENT_GROUND) * (normals[:, 2] + 1) / 2
    for direction, strength in LIGHTS:
        light = light + strength * np.clip(
            normals @ (direction / np.linalg.norm(direction)).astype(np.float32), 0, None
        )
    return light * np.float32(1.02)


def _hash(*integers: Array) -> Array:
    """A number in [0, 1) for each tuple of integers: the same on every machine."""
    value = np.zeros(np.broadcast(*integers).shape, np.uint32)
    for i, part in enumerate(integers):
        value = (value ^ (part.astype(np.int64).astype(np.uint32) * np.uint32(0x9E3779B1 + 2 * i))) * np.uint32(
            0x85EBCA6B
        )
        value ^= value >> np.uint32(15)
    return (value / np.float32(2**32)).astype(np.float32)


def _cells(points: Array, size_m: float) -> list[Array]:
    return [np.floor(points[:, i] / size_m).astype(np.int32) for i in range(3)]


def wood(points: Array) -> Array:
    grain = np.sin(points[:, 0] * 55 + points[:, 1] * 47 + 3 * np.sin(points[:, 2] * 21 + points[:, 0] * 4))
    return (0.97 + 0.025 * grain).astype(np.float32)


def fabric(points: Array) -> Array:
    return np.float32(0.93) + np.float32(0.12) * _hash(*_cells(points, 0.012))


def leaf(points: Array) -> Array:
    return np.float32(0.65) + np.float32(0.6) * _hash(*_cells(points, 0.028))


def wall(points: Array) -> Array:
    """A little darker towards the floor, a little uneven."""
    return np.float32(0.90) + np.clip(points[:, 2] / 2.5, 0, 1) * np.float32(0.1)


def books(points: Array) -> Array:
    """Narrow spines of differing brightness."""
    return np.float32(0.7) + np.float32(0.55) * _hash(*_cells(points, 0.031)[:2])


def rug(points: Array) -> Array:
    x, y = points[:, 0], points[:, 1]
    diamonds = (np.floor((x + y) / 0.16) + np.floor((x - y) / 0.16)) % 2
    return (0.82 + 0.3 * diamonds + 0.06 * _hash(*_cells(points, 0.01))).astype(np.float32)


TEXTURES = {"wood": wood, "fabric": fabric, "leaf": leaf, "wall": wall, "books": books, "rug": rug}


def floor_texture(world: World) -> tuple[Array, Array]:
    """The (x, y) of its corner and the (h, w, 3) float32 colours of the whole floor, row = y."""
    corners = np.concatenate([np.array(room.polygon) for room in world.rooms])
    low, high = corners.min(axis=0), corners.max(axis=0)
    columns, rows = np.ceil((high - low) / TEXEL_M).astype(int)
    x, y = np.meshgrid(low[0] + (np.arange(columns) + 0.5) * TEXEL_M, low[1] + (np.arange(rows) + 0.5) * TEXEL_M)
    image = np.full((rows, columns, 3), PALETTE["grey"], np.float32)
    centres = np.column_stack((x.ravel(), y.ravel()))
    for room in world.rooms:
        here = inside(centres, room.polygon).reshape(rows, columns)
        brightness = FLOOR_PATTERNS[room.floor](x[here], y[here])
        image[here] = np.array(PALETTE[FLOORS[room.floor]]) * brightness[:, None]
    return low, image


def planks(x: Array, y: Array) -> Array:
    """Boards of 0.14 m along x, joints staggered."""
    return _boards(x, y, width_m=0.14, length_m=1.1, seam_m=0.008)


def parquet(x: Array, y: Array) -> Array:
    """Squares of four strips, turned by a quarter from one to the next."""
    turned = (np.floor(x / 0.4) + np.floor(y / 0.4)) % 2 == 1
    along, across = np.where(turned, y, x), np.where(turned, x, y)
    return np.float32(1.25) * _boards(along, across, width_m=0.1, length_m=0.4, seam_m=0.006)


def _boards(along: Array, across: Array, width_m: float, length_m: float, seam_m: float) -> Array:
    board = np.floor(across / width_m).astype(np.int32)
    shifted = along + (_hash(board) * length_m if length_m > 0.5 else 0.0)
    piece = np.floor(shifted / length_m).astype(np.int32)
    seam = (across % width_m < seam_m) | (shifted % length_m < seam_m)
    grain = 0.03 * np.sin(across * 380 + 2 * np.sin(along * 9)) * _hash(board, piece)
    return np.where(seam, 0.62, 0.86 + 0.22 * _hash(piece, board) + grain).astype(np.float32)


def tiles(x: Array, y: Array) -> Array:
    column, row = np.floor(x / 0.3).astype(np.int32), np.floor(y / 0.3).astype(np.int32)
    joint = (x % 0.3 < 0.01) | (y % 0.3 < 0.01)
    return np.where(joint, 0.72, 0.98 + 0.07 * _hash(column, row) + 0.05 * ((column + row) % 2)).astype(np.float32)


def carpet(x: Array, y: Array) -> Array:
    return np.float32(0.95) + np.float32(0.2) * _hash((x / TEXEL_M).astype(np.int32), (y / TEXEL_M).astype(np.int32))


FLOOR_PATTERNS = {"planks": planks, "parquet": parquet, "tiles": tiles, "carpet": carpet}


def contact_shade(world: World, low: Array, shape: tuple[int, ...]) -> Array:
    """(h, w) float32 in [0, 0.55]: how much of the light the things standing there take from the floor around them."""
    import cv2

    covered = np.zeros(shape, np.float32)
    for mesh in [*world.walls, *(o.mesh for o in world.objects)]:
        points = mesh.points
        near_floor = points[(points[:, 2] < 0.5) & (points[:, 2] > 0.03)]
        column, row = ((near_floor[:, :2] - low) / TEXEL_M).astype(int).T
        ok = (row >= 0) & (row < shape[0]) & (column >= 0) & (column < shape[1])
        covered[row[ok], column[ok]] = 1
    grown = cv2.dilate(covered, np.ones((5, 5), np.uint8))
    return np.clip(0.55 * cv2.GaussianBlur(grown, (0, 0), 7) + 0.4 * cv2.GaussianBlur(grown, (0, 0), 18), 0, 0.55)
