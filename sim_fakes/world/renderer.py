"""What the flat looks like: colour, ideal depth and instance ids by ray casting (Open3D, no OpenGL, no display)."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from drivers.realsense.libusb import ensure_libusb
from openbelief.arrays import Array
from openbelief.observation import Intrinsics
from sim_fakes.world.mesh import merge
from sim_fakes.world.shading import Shading
from sim_fakes.world.world import FLOOR_ID, WALL_ID, World

NOTHING = 0
EMPTY_RGB = 24


@dataclass(frozen=True)
class Rendered:
    """color: (h, w, 3) uint8 RGB. depth_m: (h, w) float32 along the optical axis, without error, 0 = nothing hit.
    instances: (h, w) int32 object ids; 1 floor, 2 wall, 0 nothing."""

    color: Array
    depth_m: Array
    instances: Array


@dataclass(frozen=True)
class Hits:
    """Where rays ended, (h, w, ...): map points, depth, instance ids, triangles and barycentric coordinates there."""

    points: Array
    depth_m: Array
    instances: Array
    triangles: Array
    uvs: Array


class Renderer:
    """Builds its ray-casting scene once (about 0.1 s after Open3D's import of some seconds)."""

    def __init__(self, world: World) -> None:
        self._o3d = _open3d()
        self._scene = self._o3d.t.geometry.RaycastingScene(nthreads=2)
        meshes = [world.floor, merge(world.walls), *(o.mesh for o in world.objects)]
        for mesh in meshes:
            self._scene.add_triangles(mesh.vertices.astype(np.float32), mesh.triangles.astype(np.uint32))
        self._ids = np.array([FLOOR_ID, WALL_ID, *(o.id for o in world.objects)], dtype=np.int32)
        self._first_triangle = np.cumsum([0, *(len(m.triangles) for m in meshes[:-1])])
        self._shading = Shading(world, meshes)
        self._pool = ThreadPoolExecutor(2, thread_name_prefix="shading")
        corners = np.concatenate([np.array(room.polygon) for room in world.rooms])
        self._extent = (corners.min(axis=0), corners.max(axis=0))

    def render(self, T_map_camera: Array, intrinsics: Intrinsics) -> Rendered:
        """The view of a camera at (4, 4) `T_map_camera`, optical frame."""
        directions = _ray_grid(intrinsics) @ T_map_camera[:3, :3].T.astype(np.float32)
        return self._shaded(self._cast(T_map_camera[:3, 3], directions))

    def segment(self, T_map_camera: Array, intrinsics: Intrinsics) -> tuple[Array, Array]:
        """`render`'s depth_m and instances alone, in a third of the time."""
        directions = _ray_grid(intrinsics) @ T_map_camera[:3, :3].T.astype(np.float32)
        hits = self._cast(T_map_camera[:3, 3], directions)
        return hits.depth_m, hits.instances

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
        return self._shaded(self._cast(origins, directions)).color, low, high

    def scan(self, T_map_lidar: Array, directions: Array) -> Array:
        """(n,) float32 ranges, metres, along (n, 3) unit directions of the lidar frame; inf where nothing is hit."""
        rays = np.concatenate(
            (np.broadcast_to(T_map_lidar[:3, 3], directions.shape), directions @ T_map_lidar[:3, :3].T), axis=1
        )
        return self._scene.cast_rays(self._tensor(rays))["t_hit"].numpy()

    def _tensor(self, rays: Array) -> Any:
        return self._o3d.core.Tensor(np.ascontiguousarray(rays, dtype=np.float32))

    def _cast(self, origins: Array, directions: Array) -> Hits:
        """Rays from (3,) or (h, w, 3) origins along (h, w, 3) directions; depth is in units of a direction's length."""
        rays = np.empty((*directions.shape[:2], 6), np.float32)
        rays[..., :3], rays[..., 3:] = origins, directions
        hit = {key: value.numpy() for key, value in self._scene.cast_rays(self._tensor(rays)).items()}
        seen = np.isfinite(hit["t_hit"])
        depth = np.where(seen, hit["t_hit"], 0).astype(np.float32)
        geometry = np.where(seen, hit["geometry_ids"], 0).astype(np.int32)
        triangles = np.where(seen, self._first_triangle[geometry] + hit["primitive_ids"], 0)
        instances = np.where(seen, self._ids[geometry], NOTHING).astype(np.int32)
        return Hits(rays[..., :3] + rays[..., 3:] * depth[..., None], depth, instances, triangles, hit["primitive_uvs"])

    def _shaded(self, hits: Hits) -> Rendered:
        """Upper and lower half side by side: numpy lets go of the interpreter in its long loops."""
        points, triangles, uvs = hits.points.reshape(-1, 3), hits.triangles.ravel(), hits.uvs.reshape(-1, 2)
        half = len(points) // 2
        halves = self._pool.map(
            lambda part: self._shading.colours(points[part], triangles[part], uvs[part]),
            (slice(None, half), slice(half, None)),
        )
        color = np.concatenate(list(halves)).reshape(hits.points.shape)
        color[hits.instances == NOTHING] = EMPTY_RGB
        return Rendered(color, hits.depth_m, hits.instances)


def _open3d() -> Any:
    """The module; Any, for its stubs lack the overloads that take numpy arrays."""
    ensure_libusb()
    import open3d

    return open3d


@lru_cache(maxsize=4)
def _ray_grid(intrinsics: Intrinsics) -> Array:
    """(h, w, 3) float32 rays of the pixel centres with z = 1, optical frame."""
    v, u = np.mgrid[0 : intrinsics.height, 0 : intrinsics.width].reshape(2, -1)
    rays = np.column_stack((intrinsics.rays(u, v), np.ones(u.size)))
    return rays.reshape(intrinsics.height, intrinsics.width, 3).astype(np.float32)
