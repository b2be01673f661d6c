"""Rooms from a file: a JSON list of names and polygons, or a file that holds one as "rooms" (a truth file)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from openbelief.documents import from_json
from robot_app.cli import Failure

if TYPE_CHECKING:
    from openbelief.rooms import Room

FORM = '[{"name": "kitchen", "polygon": [[x, y], ...]}, ...], metres in the map frame'


def read_rooms(path: Path) -> tuple[Room, ...]:
    """Raises Failure with one line that names the file."""
    from openbelief.rooms import rooms_of

    try:
        said = from_json(path.read_text(encoding="utf-8"))
        rooms = rooms_of(said.get("rooms") if isinstance(said, dict) else said)
    except OSError as error:
        raise Failure(f"{path} cannot be read: {error.strerror}.") from error
    except ValueError as error:
        raise Failure(f"{path} names no rooms: {error}") from error
    if not rooms:
        raise Failure(f"{path} names no rooms: its list is empty.")
    return rooms
