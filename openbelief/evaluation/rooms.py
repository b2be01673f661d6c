"""Are objects in the right rooms? Rooms found by a memory against the true ones, matched one to one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from openbelief.evaluation.truth import TrueObject
from openbelief.memory import ObjectMemory
from openbelief.request.places import kind_of_place
from openbelief.rooms import Room, room_at


def evaluate_rooms(memory: ObjectMemory, rooms: Sequence[Room], objects: Mapping[int, TrueObject]) -> dict[str, Any]:
    """Share of mapped foreground objects in the right room.

    rooms: the true ones. The room of an object is that of the true object whose box holds its centroid, else that of
    the centroid itself; one that stands in none is not counted. A found room stands for the true one
    that it shares most objects with, each for one only, so a room found in two parts or two found as one cost their
    smaller part. named: of the derived rooms that stand for a true one, how many are called by a name of its kind, by
    another, or only numbered.
    """
    nodes = [node for node in memory.objects if not node.background]
    true = {node.id: _true_room(node.centroid, rooms, objects.values()) for node in nodes}
    counted = [node for node in nodes if true[node.id] is not None]
    matched = _matched(Counter((node.room, true[node.id]) for node in counted if node.room is not None))
    right = [node.id for node in counted if node.room is not None and matched.get(node.room) == true[node.id]]
    return {
        "objects": len(counted),
        "right": len(right) / len(counted) if counted else None,
        "rooms": len(rooms),
        "rooms_found": len(memory.rooms),
        "given": sum(room.given for room in memory.rooms),
        "matched": dict(sorted(matched.items())),
        "named": _named(memory.rooms, matched),
        "wrong": [
            {"object": node.id, "label": node.label, "room": node.room, "true": true[node.id]}
            for node in counted
            if node.id not in set(right)
        ],
    }


def _named(rooms: Sequence[Room], matched: Mapping[str | None, str | None]) -> dict[str, int]:
    """A corridor may be called a hallway, and a bedroom "bedroom 2"."""
    said = Counter(
        _how_named(room.name, matched[room.name]) for room in rooms if not room.given and room.name in matched
    )
    return {how: said[how] for how in ("right", "wrong", "numbered")}


def _how_named(name: str, true: str | None) -> str:
    name = name.rstrip(" 0123456789")
    if name == "room":
        return "numbered"
    return "right" if name == true or kind_of_place(name) == kind_of_place(true or "") is not None else "wrong"


def _true_room(centroid: Any, rooms: Sequence[Room], objects: Iterable[TrueObject]) -> str | None:
    around = [thing for thing in objects if thing.contains(centroid, 0.0)]
    boxes = (room_at(thing.aabb.mean(axis=0)[:2], rooms) for thing in around)
    return next((room for room in boxes if room is not None), None) or room_at(centroid[:2], rooms)


def _matched(shared: Counter[tuple[str | None, str | None]]) -> dict[str | None, str | None]:
    """Found room -> true room, one to one, so that most objects agree."""
    from scipy.optimize import linear_sum_assignment

    found, true = (sorted({str(pair[side]) for pair in shared}) for side in (0, 1))
    table = np.array([[shared[f, t] for t in true] for f in found]).reshape(len(found), len(true))
    rows, columns = linear_sum_assignment(-table)
    return {found[r]: true[c] for r, c in zip(rows, columns, strict=True) if table[r, c]}
