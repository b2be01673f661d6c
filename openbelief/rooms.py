"""Named areas of the floor: they tell people where a thing is, and nothing ranks by them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from openbelief.arrays import Array, read_only
from openbelief.phrase import printable
from openbelief.polygon import inside

NAME_MAX = 60


@dataclass(frozen=True, eq=False)
class Room:
    """A named area of the floor. polygon_xy: (n, 2) corners in order, map frame, metres, n >= 3.

    Raises ValueError on a name that cannot be shown in one line, or corners that enclose nothing.
    """

    name: str
    polygon_xy: Array

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name or printable(self.name, NAME_MAX) != self.name:
            raise ValueError(f"A room's name should be one line of 1 to {NAME_MAX} characters, got {self.name!r:.80}.")
        corners = _corners(self.polygon_xy)
        if corners is None or _area(corners) == 0:
            raise ValueError(f"Room {self.name!r}: polygon should be (n, 2) finite corners, n >= 3, around an area.")
        object.__setattr__(self, "polygon_xy", read_only(corners))

    def contains(self, xy: Array) -> bool:
        """Even-odd rule; a point on the border may count either way."""
        return bool(inside(xy, self.polygon_xy)[0])

    def as_json(self) -> dict[str, Any]:
        return {"name": self.name, "polygon": self.polygon_xy.tolist()}


def room_at(xy: Array, rooms: Iterable[Room]) -> str | None:
    """The first room that holds a point of the map; None where none does."""
    return next((room.name for room in rooms if room.contains(xy)), None)


def rooms_of(entries: Any) -> tuple[Room, ...]:
    """Rooms of a JSON value, `[{"name": "kitchen", "polygon": [[x, y], ...]}, ...]`. Raises ValueError in one line."""
    if not isinstance(entries, list) or not all(isinstance(e, dict) and set(e) == {"name", "polygon"} for e in entries):
        raise ValueError('Rooms should be a list of {"name": ..., "polygon": [[x, y], ...]}, metres in the map frame.')
    rooms = tuple(Room(entry["name"], entry["polygon"]) for entry in entries)
    names = [room.name for room in rooms]
    if twice := [name for name in names if names.count(name) > 1]:
        raise ValueError(f"Two rooms are called {twice[0]!r}: a room is one polygon.")
    return rooms


def _corners(polygon: Array | Sequence[Any]) -> Array | None:
    """(n, 2) float64, n >= 3, finite; None where it is none."""
    try:
        corners = np.array(polygon, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    shaped = corners.ndim == 2 and corners.shape[1] == 2 and len(corners) >= 3
    return corners if shaped and np.isfinite(corners).all() else None


def _area(corners: Array) -> float:
    """Twice the enclosed area."""
    x, y = (corners - corners[0]).T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
