"""The simulated flat: a scene file turned into geometry, a floor plan and the truth about what stands where."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from openbelief.arrays import Array
from openbelief.polygon import inside
from openbelief.pose import Pose2
from openbelief.traversability import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from sim_fakes.world.furniture import PALETTE, furniture
from sim_fakes.world.mesh import Mesh, read_obj
from sim_fakes.world.scene import SCENES, Scene, SceneError, SceneObject, SceneRoom, read_scene
from sim_fakes.world.walls import floor_mesh, wall_meshes

GRID_M = 0.05
GRID_MARGIN_M = 0.3
OBSTACLE_BAND_M = (0.1, 1.5)  # what stops a G1, above the floor
FLOOR_ID, WALL_ID = 1, 2


@dataclass(frozen=True)
class WorldObject:
    """A thing in its place. aabb: (2, 3) min and max, map frame, metres. room: "" where it stands in none."""

    spec: SceneObject
    mesh: Mesh
    room: str

    @property
    def id(self) -> int:
        return self.spec.id

    @property
    def label(self) -> str:
        return self.spec.label

    @cached_property
    def aabb(self) -> Array:
        return np.array([self.mesh.vertices.min(axis=0), self.mesh.vertices.max(axis=0)])


class World:
    """What the simulated sensors sense. Immutable; `hash` names the scene file's bytes."""

    def __init__(self, scene: Scene, scene_hash: str, folder: Path) -> None:
        self.scene, self.hash = scene, scene_hash
        self.name = scene.name
        self.rooms: list[SceneRoom] = scene.rooms
        self.objects = [self._place(spec, folder) for spec in scene.objects]
        self.walls = wall_meshes(scene.rooms, scene.doors)
        self.floor = floor_mesh(scene.rooms)

    @classmethod
    def load(cls, path_or_name: str | Path = "flat") -> World:
        """A scene file, or the name of a built-in one. Raises SceneError."""
        path = Path(path_or_name)
        if path.suffix != ".json" and (SCENES / f"{path_or_name}.json").exists():
            path = SCENES / f"{path_or_name}.json"
        scene, scene_hash = read_scene(path)
        return cls(scene, scene_hash, path.parent)

    @property
    def start_pose(self) -> Pose2:
        return _pose(self.scene.start)

    @property
    def walk(self) -> list[Pose2]:
        """Where a mapping walk stands and looks, in order; straight lines lead from one to the next."""
        return [_pose(entry) for entry in self.scene.walk]

    def object(self, object_id: int) -> WorldObject:
        """Raises KeyError."""
        return self._by_id[object_id]

    @cached_property
    def _by_id(self) -> dict[int, WorldObject]:
        return {o.id: o for o in self.objects}

    def room_at(self, xy: Array) -> str:
        """The name of the room around a point, "" where there is none."""
        return next((r.name for r in self.rooms if inside(xy, r.polygon)[0]), "")

    def occupancy_grid(self) -> OccupancyGrid:
        """0.05 m cells: 100 where a wall or anything 0.1-1.5 m high stands, 0 on other floor, -1 outside."""
        return self._grid

    @cached_property
    def _grid(self) -> OccupancyGrid:
        corners = np.concatenate([np.array(room.polygon) for room in self.rooms])
        origin = np.floor((corners.min(axis=0) - GRID_MARGIN_M) / GRID_M) * GRID_M
        columns, rows = np.ceil((corners.max(axis=0) + GRID_MARGIN_M - origin) / GRID_M).astype(int)
        x, y = np.meshgrid(
            origin[0] + (np.arange(columns) + 0.5) * GRID_M, origin[1] + (np.arange(rows) + 0.5) * GRID_M
        )
        centres = np.column_stack((x.ravel(), y.ravel()))
        floor = np.any([inside(centres, room.polygon) for room in self.rooms], axis=0).reshape(rows, columns)
        cells = np.where(floor, FREE, UNKNOWN).astype(np.int8)
        for mesh in (*self.walls, *(o.mesh for o in self.objects)):
            cells[_footprint(mesh, origin, cells.shape)] = OCCUPIED
        return OccupancyGrid(cells, GRID_M, (float(origin[0]), float(origin[1])))

    def truth(self) -> dict[str, Any]:
        """`openbelief.truth/1`: what stands where and what answers the scene's queries. For evaluation only."""
        return {
            "format": "openbelief.truth/1",
            "name": self.name,
            "frame": "map",
            "objects": [
                {
                    "id": o.id,
                    "label": o.label,
                    "room": o.room,
                    "colour": o.spec.colour,
                    "aabb": o.aabb.round(4).tolist(),
                }
                for o in self.objects
            ],
            "rooms": [{"name": r.name, "polygon": [list(p) for p in r.polygon]} for r in self.rooms],
            "queries": [q.model_dump() for q in self.scene.queries],
        }

    def _place(self, spec: SceneObject, folder: Path) -> WorldObject:
        colour = np.array(PALETTE[spec.colour])
        try:
            body = (
                read_obj(folder / spec.mesh, colour)
                if spec.mesh is not None
                else furniture(str(spec.shape), np.array(spec.size), colour)
            )
        except (OSError, ValueError) as error:
            raise SceneError(f"object {spec.id} ({spec.label}): field 'mesh': {error}") from error
        position = np.array([*spec.position, 0.0][:3])
        return WorldObject(spec, body.moved(position, np.deg2rad(spec.yaw_deg)), self.room_at(position[:2]))


def _pose(entry: tuple[float, float, float]) -> Pose2:
    return Pose2(entry[0], entry[1], float(np.deg2rad(entry[2])))


def _footprint(mesh: Mesh, origin: Array, shape: tuple[int, ...]) -> Array:
    """(h, w) bool: the cells that a mesh blocks, what it encloses included (a wardrobe is not hollow to a robot)."""
    from scipy.ndimage import binary_fill_holes

    points = mesh.points
    points = points[(points[:, 2] >= OBSTACLE_BAND_M[0]) & (points[:, 2] <= OBSTACLE_BAND_M[1])]
    column, row = np.floor((points[:, :2] - origin) / GRID_M).astype(int).T
    ok = (row >= 0) & (row < shape[0]) & (column >= 0) & (column < shape[1])
    cells = np.zeros(shape, bool)
    cells[row[ok], column[ok]] = True
    if not cells.any():
        return cells
    ys, xs = np.nonzero(cells)
    window = np.s_[ys.min() : ys.max() + 1, xs.min() : xs.max() + 1]
    cells[window] = binary_fill_holes(cells[window])
    return cells
