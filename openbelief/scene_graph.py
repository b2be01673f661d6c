"""The scene graph over a memory: floors, rooms, views and objects (paper Sec. II). Derived: it points at nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from openbelief.floors import Floor, floors_of
from openbelief.memory import ObjectMemory
from openbelief.occupancy import MAX_SIDE_M
from openbelief.rooms import Room
from openbelief.views import View, best_views, views_of

NO_MAP = (
    "No navigation map was recorded (/map, nav_msgs/OccupancyGrid): rooms are drawn from what the cameras saw, and "
    "neighbouring ones may run together. Record one, or give rooms with map --rooms."
)
TOO_WIDE = (
    f"The walk spans more than {MAX_SIDE_M:g} m and no navigation map was recorded (/map, nav_msgs/OccupancyGrid): no "
    "rooms were drawn. Record one, map it part by part, or give rooms with map --rooms."
)


@dataclass(frozen=True)
class RoomNode:
    """A room of a floor and the ids of the objects in it. room: None gathers what lies in no known room."""

    room: Room | None
    objects: tuple[int, ...]

    @property
    def name(self) -> str | None:
        return self.room.name if self.room else None


@dataclass(frozen=True)
class FloorNode:
    """A storey and its rooms; the nameless one, with what lies in none, comes last and only where something does."""

    floor: Floor
    rooms: tuple[RoomNode, ...]


class SceneGraph:
    """floors, lowest first; views by recording and stamp; object ids are those of the memory.

    Views are found when they are asked for: every keyframe's depth is read and compared with every object.
    """

    def __init__(self, memory: ObjectMemory) -> None:
        self.memory = memory

    @cached_property
    def floors(self) -> tuple[FloorNode, ...]:
        """Storeys with their rooms."""
        objects = self.memory.objects
        clouds = [] if self.memory.surroundings.views else [node.points for node in objects]
        floors = floors_of(self.memory.surroundings, clouds)
        return tuple(FloorNode(floor, self._rooms(floor, floors)) for floor in floors)

    @cached_property
    def views(self) -> tuple[View, ...]:
        return views_of(self.memory)

    @cached_property
    def best_view(self) -> dict[int, int]:
        """Object id -> the index of the view that shows it best."""
        return best_views(self.views)

    @property
    def rooms(self) -> tuple[RoomNode, ...]:
        """Of all floors."""
        return tuple(room for floor in self.floors for room in floor.rooms)

    @property
    def lacks(self) -> str | None:
        """What the file does not say: it is from before keyframes were kept, or no map was recorded. None: nothing."""
        if self.memory.surroundings.views:
            if self.memory.surroundings.maps:
                return None
            walked = np.array([view.T_map_camera[:2, 3] for view in self.memory.surroundings.views])
            if not self.memory.rooms and (np.ptp(walked, axis=0) > MAX_SIDE_M).any():
                return TOO_WIDE
            return None if all(room.given for room in self.memory.rooms) else NO_MAP
        missing = "no keyframes: views have no poses or pictures, rooms are only those given"
        return f"This file is from before they were kept and holds {missing}. Map its recordings again to get them."

    def as_json(self) -> dict[str, Any]:
        """floors -> rooms -> object ids; views; objects: what `openbelief inspect --json` prints."""
        return {
            "floors": [_floor_json(floor) for floor in self.floors],
            "views": [
                {
                    "recording": view.recording,
                    "stamp_ns": view.stamp_ns,
                    "pose": None if view.T_map_camera is None else view.T_map_camera.tolist(),
                    "objects": list(view.objects),
                }
                for view in self.views
            ],
            "objects": [
                {
                    "id": node.id,
                    "label": node.label,
                    "room": node.room,
                    "best_view": self._best_view_json(node.id),
                    "background": node.background,
                }
                for node in self.memory.objects
            ],
        }

    def _best_view_json(self, object_id: int) -> dict[str, Any] | None:
        index = self.best_view.get(object_id)
        if index is None:
            return None
        return {"view": index, "recording": self.views[index].recording, "stamp_ns": self.views[index].stamp_ns}

    def _rooms(self, floor: Floor, floors: Sequence[Floor]) -> tuple[RoomNode, ...]:
        """The rooms in which something of this floor stands, and empty ones whose heights are its own."""
        here = [node for node in self.memory.objects if floor.holds(float(node.centroid[2]))]
        rooms = []
        for room in self.memory.rooms:
            objects = tuple(node.id for node in here if node.room == room.name)
            if objects or self._stands_on(room, floors) == floor.id:
                rooms.append(RoomNode(room, objects))
        rest = tuple(node.id for node in here if node.room is None)
        return (*rooms, *([RoomNode(None, rest)] if rest else []))

    def _stands_on(self, room: Room, floors: Sequence[Floor]) -> int | None:
        """The floor of a room in which nothing stands; None where its objects say."""
        if any(node.room == room.name for node in self.memory.objects):
            return None
        if room.heights_m is None:
            return floors[0].id
        return next(floor.id for floor in floors if floor.holds(sum(room.heights_m) / 2))


def scene_graph(memory: ObjectMemory) -> SceneGraph:
    """The memory's floors, rooms, views and objects."""
    return SceneGraph(memory)


def _floor_json(node: FloorNode) -> dict[str, Any]:
    return {
        "id": node.floor.id,
        "height_m": node.floor.height_m,
        "rooms": [_room_json(room.room, room.objects) for room in node.rooms if room.room is not None],
        "in_no_room": [i for room in node.rooms if room.room is None for i in room.objects],
    }


def _room_json(room: Room, objects: Sequence[int]) -> dict[str, Any]:
    """id: its name, which no other room of the site has."""
    return {
        "id": room.name,
        "name": room.name,
        "given": room.given,
        "polygon": room.polygon_xy.tolist(),
        "because": room.because or "given by a person",
        "objects": list(objects),
    }
