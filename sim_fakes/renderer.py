"""What the flat looks like: colour, ideal depth and instance ids by ray casting (Open3D, no OpenGL, no display)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from drivers.libusb import ensure_libusb
from openbelief.arrays import Array
from openbelief.observation import Intrinsics
from sim_fakes.mesh import merge
from sim_fakes.shading import Shading
from sim_fakes.world import FLOOR_ID, WALL_ID, World

NOTHING = 0


@dataclass(frozen=True)
class Rendered:
    """color: (h, w, 3) uint8 RGB. depth_m: (h, w) float32 along the optical axis, without error, 0 = nothing hit.
    instances: (h, w) int32 object ids; 1 floor, 2 wall, 0 nothing."""

    color: Array
    depth_m: Array
    instances: Array


class Renderer:
    """Builds its ray-casting scene once (about 0.1 s after Open3D's import of some seconds)."""

    def __init__(self, world: World) -> None:
        ensure_libusb()
        import open3d as o3d

        meshes = [world.floor, merge(world.walls), *(o.mesh for o in world.objects)]
        self._o3d, self._scene = o3d, o3d.t.geometry.RaycastingScene(nthreads=2)
        for mesh in meshes:
            self._scene.add_triangles(mesh.vertices.astype(np.float32), mesh.triangles.astype(np.uint32))
        self._ids = np.array([FLOOR_ID, WALL_ID, *(o.id for o in world.objects)], dtype=np.int32)
        self._first_triangle = np.cumsum([0, *(len(m.triangles) for m in meshes[:-1])])
        self._shading = Shading(world, meshes)
        corners = np.concatenate([np.array(room.polygon) for room in world.rooms])
        self._extent = (corners.min(axis=0), corners.max(axis=0))

    def render(self, T_map_camera: Array, intrinsics: Intrinsics) -> Rendered:
        """The view of a camera at (4, 4) `T_map_camera`, optical frame."""
        directions = _ray_grid(intrinsics) @ T_map_camera[:3, :3].T
        origins = np.broadcast_to(T_map_camera[:3, 3], directions.shape)
        return self._cast(origins, directions)  # unit depth per unit of t: t is the depth

    def top_view(self, pixels_per_m: float) -> tuple[Array, Array, Array]:
        """The flat from above without a roof: (h, w, 3) uint8, and the map (x, y) of its lower left and upper right.

        Row 0 is the largest y, as on a map with north up.
        """
        low, high = self._extent
        columns, rows = np.ceil((high - low) * pixels_per_m).astype(int)
        x = low[0] + (np.arange(columns) + 0.5) / pixels_per_m
        y = high[1] - (np.arange(rows) + 0.5) / pixels_per_m
        origins = np.stack([*np.meshgrid(x, y), np.full((rows, columns), 5.0)], axis=-1)
        directions = np.broadcast_to([0.0, 0.0, -1.0], origins.shape)
        return self._cast(origins, directions).color, low, high

    def scan(self, T_map_lidar: Array, directions: Array) -> Array:
        """(n,) float32 ranges, metres, along (n, 3) unit directions of the lidar frame; inf where nothing is hit."""
        rays = np.concatenate(
            (np.broadcast_to(T_map_lidar[:3, 3], directions.shape), directions @ T_map_lidar[:3, :3].T), axis=1
        )
        return self._scene.cast_rays(self._tensor(rays))["t_hit"].numpy()

    def _tensor(self, rays: Array) -> Any:
        return self._o3d.core.Tensor(np.ascontiguousarray(rays, dtype=np.float32))

    def _cast(self, origins: Array, directions: Array) -> Rendered:
        rays = np.concatenate((origins, directions), axis=-1)
        hit = {key: value.numpy() for key, value in self._scene.cast_rays(self._tensor(rays)).items()}
        depth, geometry = hit["t_hit"], hit["geometry_ids"]
        seen = np.isfinite(depth)
        index = geometry[seen].astype(np.int64)
        triangles = self._first_triangle[index] + hit["primitive_ids"][seen]
        points = origins[seen] + directions[seen] * depth[seen][:, None]
        color = np.full((*depth.shape, 3), 24, np.uint8)
        color[seen] = self._shading.colours(points, triangles, hit["primitive_uvs"][seen])
        instances = np.full(depth.shape, NOTHING, np.int32)
        instances[seen] = self._ids[index]
        return Rendered(color, np.where(seen, depth, 0).astype(np.float32), instances)


@lru_cache(maxsize=4)
def _ray_grid(intrinsics: Intrinsics) -> Array:
    """(h, w, 3) float64 rays of the pixel centres with z = 1, optical frame."""
    v, u = np.mgrid[0 : intrinsics.height, 0 : intrinsics.width].reshape(2, -1)
    rays = np.column_stack((intrinsics.rays(u, v), np.ones(u.size)))
    return rays.reshape(intrinsics.height, intrinsics.width, 3)
