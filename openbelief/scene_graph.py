"""The scene graph over a memory: floor -> rooms -> views and objects. Thin: it points at nodes, it copies nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array
from openbelief.memory import ObjectMemory


@dataclass(frozen=True)
class Room:
    """A named area of the floor. polygon_xy: (n, 2) corners, map frame, metres, n >= 3."""

    name: str
    polygon_xy: Array

    def __post_init__(self) -> None:
        corners = np.asarray(self.polygon_xy, dtype=float)
        if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3 or not np.isfinite(corners).all():
            raise ValueError(f"Room {self.name!r}: polygon should be (n, 2) finite corners, n >= 3.")

    def contains(self, xy: Array) -> bool:
        """Even-odd rule; a point on the border may count either way."""
        x, y = float(xy[0]), float(xy[1])
        corners = np.asarray(self.polygon_xy, dtype=float)
        ends = np.roll(corners, -1, axis=0)
        crosses = (corners[:, 1] > y) != (ends[:, 1] > y)
        (x0, y0), (x1, y1) = corners[crosses].T, ends[crosses].T
        return bool(np.count_nonzero(x < x0 + (y - y0) / (y1 - y0) * (x1 - x0)) % 2)


@dataclass(frozen=True)
class View:
    """A frame that evidence came from, and the objects it shows."""

    recording: str
    frame: int
    objects: tuple[int, ...]


@dataclass(frozen=True)
class RoomNode:
    """name: None gathers what lies in no known room."""

    name: str | None
    objects: tuple[int, ...]


@dataclass(frozen=True)
class SceneGraph:
    """One floor. Object ids are those of the memory."""

    rooms: tuple[RoomNode, ...]
    views: tuple[View, ...]

    def room_of(self, object_id: int) -> str | None:
        """None where unknown."""
        return next((room.name for room in self.rooms if object_id in room.objects), None)


def scene_graph(memory: ObjectMemory, rooms: Sequence[Room] = ()) -> SceneGraph:
    """An object is in the first room whose polygon holds its centroid; without rooms all are in the unknown one."""
    names = [node.room or _room_at(node.centroid, rooms) for node in memory.objects]
    known = dict.fromkeys([room.name for room in rooms] + [name for name in names if name])
    groups = [RoomNode(name, _ids(names, name)) for name in [*known, None]]
    seen: dict[tuple[str, int], list[int]] = {}
    for node in memory.objects:
        for key in sorted({(o.recording, o.frame) for o in node.observations}):
            seen.setdefault(key, []).append(node.id)
    views = tuple(View(recording, frame, tuple(ids)) for (recording, frame), ids in sorted(seen.items()))
    return SceneGraph(tuple(room for room in groups if room.name or room.objects), views)


def _room_at(centroid: Array, rooms: Sequence[Room]) -> str | None:
    return next((room.name for room in rooms if room.contains(centroid[:2])), None)


def _ids(names: Sequence[str | None], wanted: str | None) -> tuple[int, ...]:
    return tuple(i for i, name in enumerate(names) if name == wanted)
