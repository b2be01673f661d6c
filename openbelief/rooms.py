"""Named areas of the floor, given by people or derived from the map: where a thing stands."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from openbelief.arrays import Array, read_only
from openbelief.phrase import printable
from openbelief.polygon import inside

NAME_MAX = 60
NEEDED, KNOWN = {"name", "polygon"}, {"name", "polygon", "heights_m", "given", "because"}  # of a room in JSON


@dataclass(frozen=True, eq=False)
class Room:
    """A named area of the floor. polygon_xy: (n, 2) corners in order, map frame, metres, n >= 3.

    given: a person said so; else it was derived from the map, and `because` says what its name rests on. heights_m:
    the (from, to) z of what stands on its floor, where storeys lie above each other; None holds at any height. Raises
    ValueError on a name that cannot be shown in one line, corners that enclose nothing, or heights that are no range.
    """

    name: str
    polygon_xy: Array
    given: bool = True
    because: str = ""
    heights_m: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name or printable(self.name, NAME_MAX) != self.name:
            raise ValueError(f"A room's name should be one line of 1 to {NAME_MAX} characters, got {self.name!r:.80}.")
        corners = _corners(self.polygon_xy)
        if corners is None or _area(corners) == 0:
            raise ValueError(f"Room {self.name!r}: polygon should be (n, 2) finite corners, n >= 3, around an area.")
        object.__setattr__(self, "polygon_xy", read_only(corners))
        if self.heights_m is not None:
            object.__setattr__(self, "heights_m", _heights(self.heights_m, self.name))

    def contains(self, point: Array) -> bool:
        """(x, y) or (x, y, z). Even-odd rule; a point on the border may count either way."""
        low, high = self.heights_m or (-np.inf, np.inf)
        return bool((len(point) < 3 or low <= point[2] < high) and inside(point[:2], self.polygon_xy)[0])

    def samples(self, step_m: float) -> Array:
        """(n, 2) points of a grid inside it."""
        low, high = self.polygon_xy.min(axis=0), self.polygon_xy.max(axis=0)
        x, y = (np.arange(a + step_m / 2, b, step_m) for a, b in zip(low, high, strict=True))
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        return points[inside(points, self.polygon_xy)]

    def as_json(self) -> dict[str, Any]:
        said: dict[str, Any] = {"name": self.name, "polygon": self.polygon_xy.tolist()}
        if self.heights_m is not None:
            said["heights_m"] = list(self.heights_m)
        return said if self.given else {**said, "given": False, "because": self.because}


def room_at(point: Array, rooms: Iterable[Room]) -> str | None:
    """The first room that holds a point (x, y) or (x, y, z) of the map; None where none does."""
    return next((room.name for room in rooms if room.contains(point)), None)


def rooms_at(points: Array, rooms: Sequence[Room]) -> tuple[str | None, ...]:
    """`room_at` of (n, 3) points at once."""
    return tuple(None if number < 0 else rooms[number].name for number in room_numbers(points, rooms).tolist())


def room_numbers(points: Array, rooms: Sequence[Room]) -> Array:
    """(n,) int: the place in `rooms` of the first that holds each of (n, 3) points, -1 where none does."""
    at = np.full(len(points), -1)
    for number, room in reversed(list(enumerate(rooms))):
        low, high = room.heights_m or (-np.inf, np.inf)
        at[(low <= points[:, 2]) & (points[:, 2] < high) & inside(points[:, :2], room.polygon_xy)] = number
    return at


def rooms_of(entries: Any) -> tuple[Room, ...]:
    """Rooms of a JSON value, `[{"name": "kitchen", "polygon": [[x, y], ...]}, ...]`. Raises ValueError in one line.

    "heights_m": [from, to] says which storey; "given": false and "because" are those of a derived room.
    """
    if not isinstance(entries, list) or not all(isinstance(e, dict) and NEEDED <= set(e) <= KNOWN for e in entries):
        raise ValueError('Rooms should be a list of {"name": ..., "polygon": [[x, y], ...]}, metres in the map frame.')
    rooms = tuple(
        Room(e["name"], e["polygon"], e.get("given", True) is True, str(e.get("because", "")), e.get("heights_m"))
        for e in entries
    )
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


def _heights(heights: Any, name: str) -> tuple[float, float]:
    """(from, to) with from < to; raises ValueError."""
    if isinstance(heights, list | tuple) and len(heights) == 2 and all(type(z) in (int, float) for z in heights):
        low, high = (float(z) for z in heights)
        if np.isfinite([low, high]).all() and low < high:
            return low, high
    raise ValueError(f"Room {name!r}: heights_m should be [from, to] in metres, from < to, got {heights!r:.60}.")


def _area(corners: Array) -> float:
    """Twice the enclosed area."""
    x, y = (corners - corners[0]).T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
