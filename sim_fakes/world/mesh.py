"""Triangles with a colour, a material and smooth normals: the primitives that furniture is made of, and OBJ files."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from openbelief.arrays import Array, normalize

MATERIALS = ("plain", "wood", "fabric", "leaf", "floor", "wall", "books", "rug")
SAMPLE_M = 0.025
MAX_OBJ_FACES = 200_000


@dataclass(frozen=True)
class Mesh:
    """vertices: (n, 3) float, metres. triangles: (m, 3) int. normals: (m, 3, 3), one unit row per corner.
    colours: (m, 3) float in [0, 1]. materials: (m,) uint8, indices into MATERIALS."""

    vertices: Array
    triangles: Array
    normals: Array
    colours: Array
    materials: Array

    def moved(self, position: Array, yaw: float) -> Mesh:
        """Turned about z by `yaw` radians, then shifted by `position`, metres."""
        c, s = np.cos(yaw), np.sin(yaw)
        R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        return Mesh(self.vertices @ R.T + position, self.triangles, self.normals @ R.T, self.colours, self.materials)

    @cached_property
    def points(self) -> Array:
        """(k, 3) points on the surface, no further apart than half a grid cell (0.025 m)."""
        corners = self.vertices[self.triangles]
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        steps = np.maximum(np.ceil(longest / SAMPLE_M).astype(int), 1)
        return np.concatenate([(_barycentric(k) @ corners[steps == k]).reshape(-1, 3) for k in np.unique(steps)])


def _barycentric(steps: int) -> Array:
    """(k, 3) weights of a triangular lattice with that many steps an edge."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(steps + 1), np.arange(steps + 1)))
    keep = i + j <= steps
    return np.column_stack((i, j, steps - i - j))[keep] / steps


def merge(meshes: list[Mesh]) -> Mesh:
    """One mesh of all."""
    offsets = np.cumsum([0] + [len(m.vertices) for m in meshes[:-1]])
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.triangles + o for m, o in zip(meshes, offsets, strict=True)]),
        np.concatenate([m.normals for m in meshes]),
        np.concatenate([m.colours for m in meshes]),
        np.concatenate([m.materials for m in meshes]),
    )


def painted(vertices: Array, triangles: Array, colour: Array, material: str, normals: Array | None = None) -> Mesh:
    """A mesh of one colour and material; flat normals where none are given."""
    if normals is None:
        a, b, c = (vertices[triangles[:, i]] for i in range(3))
        normals = np.repeat(normalize(np.cross(b - a, c - a))[:, None, :], 3, axis=1)
    m = len(triangles)
    materials = np.full(m, MATERIALS.index(material), np.uint8)
    return Mesh(vertices, triangles, normals, np.tile(np.asarray(colour, float), (m, 1)), materials)


def box(low: Array, high: Array, colour: Array, material: str = "plain") -> Mesh:
    """An axis-aligned box between two (3,) corners."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    vertices = np.asarray(low) + corners * (np.asarray(high) - np.asarray(low))
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    return painted(vertices, triangles, colour, material)


def lathe(centre: Array, profile: Array, colour: Array, material: str = "plain", segments: int = 24) -> Mesh:
    """A closed profile (k, 3) of (x radius, y radius, z) turned about the vertical through `centre` (2,)."""
    angles = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    ring = np.column_stack((np.cos(angles), np.sin(angles)))
    k = len(profile)
    vertices = np.concatenate(
        [np.column_stack((centre + ring * row[:2], np.full(segments, row[2]))) for row in profile]
    )
    here = np.arange(k - 1)[:, None] * segments + np.arange(segments)
    right = np.arange(k - 1)[:, None] * segments + (np.arange(segments) + 1) % segments
    lower = np.stack((here, right, right + segments), axis=-1).reshape(-1, 3)
    upper = np.stack((here, right + segments, here + segments), axis=-1).reshape(-1, 3)
    triangles = np.concatenate((lower, upper))
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    solid = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-10
    triangles = triangles[solid]
    return painted(vertices, triangles, colour, material, _lathe_normals(profile, ring, triangles, segments))


def _lathe_normals(profile: Array, ring: Array, triangles: Array, segments: int) -> Array:
    """(m, 3, 3): smooth around the axis, flat along it unless the profile is round there (a ball)."""
    slope = np.diff(profile, axis=0)
    outward = normalize(np.column_stack((slope[:, 2], -slope[:, :2].mean(axis=1))))  # (radial, vertical) per band
    at_ring = np.concatenate((outward[:1], outward[:-1] + outward[1:], outward[-1:]))
    sharp = np.concatenate(([True], np.einsum("ij,ij->i", outward[:-1], outward[1:]) < 0.8, [True]))
    band = triangles.min(axis=1) // segments
    row, column = triangles // segments, triangles % segments
    radial_vertical = np.where(sharp[row][..., None], outward[band][:, None, :], normalize(at_ring)[row])
    return np.concatenate((ring[column] * radial_vertical[..., :1], radial_vertical[..., 1:]), axis=-1)


def read_obj(path: Path, colour: Array) -> Mesh:
    """The `v` and `f` lines of a Wavefront OBJ, metres, z up. Raises ValueError naming file and line."""
    vertices: list[list[float]] = []
    triangles: list[list[int]] = []
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        words = line.split()
        try:
            if words[:1] == ["v"]:
                vertices.append([float(w) for w in words[1:4]])
            elif words[:1] == ["f"]:
                corners = [int(w.split("/")[0]) for w in words[1:]]
                corners = [c - 1 if c > 0 else len(vertices) + c for c in corners]
                triangles += [[corners[0], a, b] for a, b in itertools.pairwise(corners[1:])]
        except ValueError as error:
            raise ValueError(f"{path.name}, line {number}: {error}.") from error
        if len(triangles) > MAX_OBJ_FACES:
            raise ValueError(f"{path.name} has more than {MAX_OBJ_FACES} faces.")
    points, faces = np.array(vertices, dtype=float), np.array(triangles, dtype=int)
    if not len(faces) or points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ValueError(f"{path.name} holds no usable mesh: it needs finite 'v x y z' lines and 'f' lines.")
    if faces.min() < 0 or faces.max() >= len(points):
        raise ValueError(f"{path.name} has a face that names a vertex outside 1..{len(points)}.")
    return painted(points, faces, colour, "plain")
