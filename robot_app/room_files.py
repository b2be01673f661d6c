"""Rooms from a file: a JSON list of names and polygons, or a file that holds one as "rooms" (a truth file)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from openbelief.documents import from_json
from robot_app.cli import Failure

if TYPE_CHECKING:
    from openbelief.rooms import Room

FORM = '[{"name": "kitchen", "polygon": [[x, y], ...]}, ...], metres in the map frame'

DRAWN_CORNERS_MAX = 2000  # of what a person draws; a program traces outlines in order


def read_rooms(path: Path) -> tuple[Room, ...]:
    """Raises Failure with one line that names the file. All of them are given: a person gives the file."""
    from openbelief.rooms import rooms_of

    try:
        said = from_json(path.read_text(encoding="utf-8-sig"))  # as a Windows editor writes it, too
        rooms = rooms_of(said.get("rooms") if isinstance(said, dict) else said)
        for room in rooms:
            _require_outline(room)
    except OSError as error:
        raise Failure(f"{path} cannot be read: {error.strerror}.") from error
    except ValueError as error:
        raise Failure(f"{path} names no rooms: {error}") from error
    if not rooms:
        raise Failure(f"{path} names no rooms: its list is empty.")
    return tuple(replace(room, given=True, because="") for room in rooms)


def _require_outline(room: Room) -> None:
    """Raises ValueError where the corners are not in order: half of such a room would be outside."""
    from openbelief.polygon import crossing

    edges = crossing(room.polygon_xy) if len(room.polygon_xy) <= DRAWN_CORNERS_MAX else None
    if edges is not None:
        one, other = (f"({x0:g}, {y0:g})-({x1:g}, {y1:g})" for (x0, y0), (x1, y1) in edges)
        raise ValueError(f"Room {room.name!r}: its edges {one} and {other} cross; give the corners in order.")
