"""The scene graph over a memory: floor -> rooms -> views and objects. Thin: it points at nodes, it copies nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from openbelief.memory import ObjectMemory


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


def scene_graph(memory: ObjectMemory) -> SceneGraph:
    """The memory's rooms, empty ones too, the unknown one if an object lies in none, and the frames with evidence."""
    names = [node.room for node in memory.objects]
    groups = [RoomNode(name, _ids(names, name)) for name in [*(room.name for room in memory.rooms), None]]
    seen: dict[tuple[str, int], list[int]] = {}
    for node in memory.objects:
        for key in sorted({(o.recording, o.frame) for o in node.observations}):
            seen.setdefault(key, []).append(node.id)
    views = tuple(View(recording, frame, tuple(ids)) for (recording, frame), ids in sorted(seen.items()))
    return SceneGraph(tuple(room for room in groups if room.name or room.objects), views)


def _ids(names: Sequence[str | None], wanted: str | None) -> tuple[int, ...]:
    return tuple(i for i, name in enumerate(names) if name == wanted)
