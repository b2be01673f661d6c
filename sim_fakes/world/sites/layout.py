"""Rooms on both sides of a corridor, furnished by lot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array
from sim_fakes.world.sites.catalogue import Thing, marks, things

PLANS = (
    ("hallway", "living room", "kitchen", "bedroom", "bathroom", "study", "kids room", "garage"),
    ("hallway", "living room", "dining room", "kitchen", "bedroom", "bathroom", "office", "balcony"),
    ("hallway", "office", "kitchen", "bathroom", "storage room", "living room", "laundry room"),
    ("entrance", "living room", "kitchen", "bedroom", "kids room", "bathroom", "laundry room", "balcony"),
)
COLOURS = ("red", "blue", "green", "white", "black", "brown", "gray", "yellow", "orange", "purple")
IN_A_ROOM = (5, 9)  # pieces that stand on its floor
TWICE = 0.25  # of them, another of the same kind somewhere
CONFUSED = 0.17  # of the things: most of what is said of them is wrong, as in the development recording
CONFUSION_RATE = (0.45, 0.66)
TRIES = 200


@dataclass(frozen=True)
class RoomBox:
    """x0, y0, x1, y1: map frame, metres."""

    name: str
    x0: float
    y0: float
    x1: float
    y1: float

    def as_json(self) -> dict[str, object]:
        corners = [[self.x0, self.y0], [self.x1, self.y0], [self.x1, self.y1], [self.x0, self.y1]]
        return {"name": self.name, "polygon": corners}


@dataclass(frozen=True, eq=False)
class Placed:
    """aabb: (2, 3) float64, map frame, metres. on: the id of what it stands on, None for the floor.

    confusion_rate: how often it is called by what it is taken for, 0 where it is not.
    """

    id: int
    thing: Thing
    room: str
    colour: str
    aabb: Array
    on: int | None
    confusion_rate: float

    @property
    def label(self) -> str:
        return self.thing.label

    @property
    def asked_for(self) -> bool:
        return self.thing not in marks()

    def is_called(self, words: str) -> bool:
        """By a name of its own, or by its kind."""
        return words in self.thing.names or words in self.thing.kinds

    def as_json(self) -> dict[str, object]:
        return {
            "id": self.id,
            "label": self.label,
            "room": self.room,
            "colour": self.colour,
            "aabb": self.aabb.tolist(),
            "confused_with": self.thing.taken_for if self.confusion_rate else None,
            "confusion_rate": self.confusion_rate,
        }


def furnished(seed: int) -> tuple[list[RoomBox], list[Placed]]:
    rng = np.random.default_rng([seed, 0x517E])
    rooms = _rooms(rng, PLANS[seed % len(PLANS)])
    placed: list[Placed] = []
    for room in rooms:
        placed += _furnish(rng, room, 100 + len(placed))
    return rooms, placed


def _rooms(rng: np.random.Generator, names: Sequence[str]) -> list[RoomBox]:
    corridor, *others = names
    others = [str(name) for name in rng.permutation(others)]
    half = (len(others) + 1) // 2
    rooms = []
    for row, (y0, depth) in zip((others[:half], others[half:]), ((0.0, 4.4), (6.2, 4.0)), strict=True):
        x = 0.0
        for name in row:
            width = float(rng.uniform(3.2, 5.4))
            rooms.append(RoomBox(name, x, y0, x + width, y0 + depth))
            x += width
    return [*rooms, RoomBox(corridor, 0.0, 4.4, max(room.x1 for room in rooms), 6.2)]


def _furnish(rng: np.random.Generator, room: RoomBox, first_id: int) -> list[Placed]:
    fitting = [thing for thing in things().values() if room.name in thing.rooms]
    floor = [thing for thing in fitting if not thing.stands_on]
    chosen = [floor[i] for i in rng.permutation(len(floor))[: rng.integers(*IN_A_ROOM)]]
    supports = {label for thing in fitting for label in thing.stands_on}
    chosen = [*(t for t in floor if t.label in supports and t not in chosen), *chosen]
    chosen += [thing for thing in chosen if rng.random() < TWICE]
    placed: list[Placed] = []
    for thing in (*(mark for mark in marks() if room.name in mark.rooms), *chosen):
        if (box := _on_floor(rng, room, thing, placed)) is not None:
            placed.append(_placed(rng, first_id + len(placed), thing, room, box, None))
    for thing in (t for t in fitting if t.stands_on and rng.random() < 0.7):
        below = [p for p in placed if p.label in thing.stands_on]
        support = below[int(rng.integers(len(below)))] if below else None
        if support is not None and (box := _on_top(rng, support, thing, placed)) is not None:
            placed.append(_placed(rng, first_id + len(placed), thing, room, box, support.id))
    return placed


def _placed(rng: np.random.Generator, id: int, thing: Thing, room: RoomBox, box: Array, on: int | None) -> Placed:
    rate = float(rng.uniform(*CONFUSION_RATE)) if rng.random() < CONFUSED else 0.0
    return Placed(id, thing, room.name, str(rng.choice(COLOURS)), box, on, rate)


def _on_floor(rng: np.random.Generator, room: RoomBox, thing: Thing, placed: Sequence[Placed]) -> Array | None:
    for size in _sizes(rng, thing):
        low = np.array([room.x0, room.y0]) + 0.08
        high = np.array([room.x1, room.y1]) - 0.08 - size[:2]
        if (high < low).any():
            continue
        corner = rng.uniform(low, high)
        if rng.random() < 0.75:  # against a wall
            axis = int(rng.integers(2))
            corner[axis] = (low, high)[int(rng.integers(2))][axis]
        box = np.array([[*corner, 0.0], [*(corner + size[:2]), size[2]]])
        if not any(_meet(box, other.aabb, 0.08) for other in placed):
            return box
    return None


def _on_top(rng: np.random.Generator, support: Placed, thing: Thing, placed: Sequence[Placed]) -> Array | None:
    below = support.aabb
    for size in _sizes(rng, thing):
        high = below[1, :2] - size[:2]
        if (high < below[0, :2]).any():
            continue
        corner = rng.uniform(below[0, :2], high)
        box = np.array([[*corner, below[1, 2]], [*(corner + size[:2]), below[1, 2] + size[2]]])
        if not any(other.on == support.id and _meet(box, other.aabb, 0.03) for other in placed):
            return box
    return None


def _sizes(rng: np.random.Generator, thing: Thing) -> Iterator[Array]:
    for _ in range(TRIES):
        w, d, h = np.array(thing.size_m) * rng.uniform(0.9, 1.1)
        yield np.array([w, d, h] if rng.random() < 0.5 else [d, w, h])


def _meet(a: Array, b: Array, gap_m: float) -> bool:
    """Seen from above."""
    return bool((a[0, :2] < b[1, :2] + gap_m).all() and (b[0, :2] < a[1, :2] + gap_m).all())
