"""Rooms that nobody gave: regions of each floor's grid, named by their objects. Given rooms win."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import count

import numpy as np

from openbelief.arrays import Array
from openbelief.floors import Floor, floors_of
from openbelief.memory import ObjectMemory
from openbelief.passages import passages
from openbelief.phrase import printable
from openbelief.room_names import decided, name_scores, unique_names
from openbelief.room_regions import room_regions
from openbelief.rooms import Room, room_numbers

LOW_M, HIGH_M = 0.05, 1.6  # above the floor: what a navigation map shows as occupied
COVERED_SHARE = 0.5  # of a derived room: from there on the given ones are it
BECAUSE_MAX = 200
SAMPLE_M = 0.1


def with_derived_rooms(memory: ObjectMemory) -> ObjectMemory:
    """The memory with its given rooms first, and those derived from its maps after them; one without maps as it is.

    Raises ValueError where the memory was opened without its text encoder.
    """
    given = tuple(room for room in memory.rooms if room.given)
    return memory.with_rooms([*given, *derived_rooms(memory, given)])


def derived_rooms(memory: ObjectMemory, given: Sequence[Room] = ()) -> tuple[Room, ...]:
    """Rooms of all floors, without those that given ones cover."""
    if not memory.surroundings.views and not memory.surroundings.maps:
        return ()
    floors = floors_of(memory.surroundings, [node.points for node in memory.objects])
    found = [(outline, floor) for floor in floors for outline in _outlines(floor, memory)]
    rooms, passage = [], []
    for number, ((polygon, is_passage), floor) in enumerate(found):
        room = Room(f"room {number}", polygon, False, "", floor.room_heights_m() if len(floors) > 1 else None)
        if not _covered(room, given):
            rooms.append(room)
            passage.append(is_passage)
    if not rooms:
        return ()
    scores = name_scores(memory)
    names = decided(list(map(scores.name, _inside(rooms, memory, given), passage)))
    words = unique_names(names, [room.name for room in given])
    return tuple(
        Room(word, room.polygon_xy, False, printable(name.because, BECAUSE_MAX), room.heights_m)
        for word, room, name in zip(words, rooms, names, strict=True)
    )


def given_win(given: Sequence[Room], derived: Sequence[Room]) -> tuple[Room, ...]:
    """Given rooms first, then the derived ones that they leave over; a name that was given is not used twice."""
    kept = [room for room in derived if not _covered(room, given)]
    taken = {room.name for room in (*given, *kept)}
    rooms = list(given)
    for room in kept:
        name = room.name
        if any(name == other.name for other in rooms):
            name = next(f"{name} {n}" for n in count(2) if f"{name} {n}" not in taken)
        rooms.append(replace(room, name=name))
        taken.add(name)
    return tuple(rooms)


def _outlines(floor: Floor, memory: ObjectMemory) -> Iterable[tuple[Array, bool]]:
    """(n, 2) corners of each room, and whether it is a passage."""
    if floor.grid is None:
        return []
    nodes = [node for node in memory.objects if not node.background and floor.holds(float(node.centroid[2]))]
    points = np.concatenate([np.empty((0, 3), np.float32), *(node.points for node in nodes)])
    height = points[:, 2] - floor.height_m
    regions = room_regions(floor.grid, [points[(height > LOW_M) & (height < HIGH_M)]])
    passage = passages(regions.labels, regions.count, floor.grid.resolution_m).tolist()
    return [(regions.polygon(number + 1, floor.grid), passage[number]) for number in range(regions.count)]


def _inside(rooms: Sequence[Room], memory: ObjectMemory, given: Sequence[Room]) -> list[list[int]]:
    """The ids of the objects in each room; a given room has its own first."""
    at = room_numbers(np.array([node.centroid for node in memory.objects]).reshape(-1, 3), [*given, *rooms])
    return [[memory.objects[i].id for i in np.flatnonzero(at == len(given) + k)] for k in range(len(rooms))]


def _covered(room: Room, given: Sequence[Room]) -> bool:
    """Do given rooms of this height hold most of it?"""
    if not given:
        return False
    points = room.samples(SAMPLE_M)
    mine = [g for g in given if g.heights_m is None or room.heights_m is None or _overlap(g.heights_m, room.heights_m)]
    held = sum(any(g.contains(xy) for g in mine) for xy in points)
    return held >= COVERED_SHARE * max(len(points), 1)


def _overlap(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return min(one[1], other[1]) - max(one[0], other[0]) > 0.5 * min(one[1] - one[0], other[1] - other[0])
