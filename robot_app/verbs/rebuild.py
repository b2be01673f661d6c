"""New belief parameters over the same evidence: no camera, no perception, no text encoder is needed.

Association, weights, consolidation, smoothing, trust, fusion and projection follow the new parameters. What decides
which points were taken from a frame (voxel, depth range, filters) needs `openbelief map` again.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from openbelief.documents import from_toml
from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from openbelief.memory import ObjectMemory
    from openbelief.parameters import Parameters

EXAMPLE = "openbelief rebuild demo-out/site.belief -o new.belief --set synonym_threshold=0.85"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    from robot_app.room_files import FORM

    parser.add_argument("memory", type=Path, metavar="SITE.belief")
    parser.add_argument("-o", "--out", required=True, type=Path, metavar="NEW.belief", help="the memory to write")
    parser.add_argument("--parameters", type=Path, metavar="FILE.toml", help="parameters to change, as name = value")
    parser.add_argument(
        "--set", action="append", type=_setting, default=[], metavar="NAME=VALUE", help="one parameter to change"
    )
    parser.add_argument("--rooms", type=Path, metavar="ROOMS.json", help=f"where things stand: {FORM}")
    parser.add_argument("--force", action="store_true", help="replace NEW.belief where it exists")


def run(options: argparse.Namespace) -> None:
    from openbelief.derived_rooms import given_win
    from robot_app.memories import open_memory
    from robot_app.outputs import require_replaceable
    from robot_app.room_files import read_rooms

    if options.out.exists() and not options.force:
        raise Failure(f"{options.out} exists: choose another name, or --force to replace it.")
    require_replaceable(options.out, filter(None, (options.rooms, options.parameters)))
    if not options.out.parent.is_dir():
        raise Failure(f"The folder {options.out.parent} does not exist: create it, or choose another -o.")
    old = open_memory(options.memory)
    changes = _changes(options)
    try:
        new = old.rebuilt(_changed(old.parameters, changes))
        if options.rooms:
            new = new.with_rooms(given_win(read_rooms(options.rooms), [room for room in new.rooms if not room.given]))
            _require_some_inside(new, options.rooms)
        new.save(options.out)
    except (ValueError, TypeError) as error:
        raise Failure(str(error)) from error
    report = {
        "memory": str(options.out),
        "content_hash": new.content_hash,
        "state_hash": new.state_hash,
        "source": {"memory": str(options.memory), "content_hash": old.content_hash},
        "changed": changes,
        "observations": len(new.observations),
        "objects": len(new.objects),
        "objects_before": len(old.objects),
        "rooms": [{"name": room.name, "objects": _standing_in(new, room.name)} for room in new.rooms],
        "moved": _moved(old, new),
    }
    print_json(report) if options.json else _show(report)


def _require_some_inside(memory: ObjectMemory, rooms: Path) -> None:
    given = {room.name for room in memory.rooms if room.given}
    if memory.objects and not any(node.room in given for node in memory.objects):
        raise Failure(f"None of the {len(memory.objects)} objects stands in a room of {rooms}: is it of another site?")


def _standing_in(memory: ObjectMemory, room: str) -> int:
    return sum(node.room == room for node in memory.objects)


def _moved(old: ObjectMemory, new: ObjectMemory) -> list[dict[str, Any]]:
    """Objects whose room is another one now; none where the objects themselves are others."""
    if len(old.objects) != len(new.objects):
        return []
    pairs = zip(old.objects, new.objects, strict=True)
    return [
        {"object_id": after.id, "label": after.label, "from": before.room, "to": after.room}
        for before, after in pairs
        if before.room != after.room
    ]


def _changes(options: argparse.Namespace) -> dict[str, Any]:
    """The parameters named in the file and on the command line, which wins."""
    changes: dict[str, Any] = {}
    try:
        if options.parameters:
            changes |= from_toml(options.parameters.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise Failure(f"--parameters {options.parameters}: {error}") from error
    for each in options.set:
        changes |= each
    return changes


def _setting(text: str) -> dict[str, Any]:
    """NAME=VALUE as TOML, a bare word as text: a parameter that there is, of a value that it can have."""
    from openbelief.parameters import Parameters

    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals:
        raise argparse.ArgumentTypeError(f"should be NAME=VALUE, not {text!r}")
    try:
        setting = {name: from_toml(f"value = {value}")["value"]}
    except ValueError:
        setting = {name: value}
    try:
        Parameters.from_dict(setting)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return setting


def _changed(parameters: Parameters, changes: dict[str, Any]) -> Parameters:
    from openbelief.parameters import Parameters

    return Parameters.from_dict(parameters.to_dict() | changes)


def _show(report: dict[str, Any]) -> None:
    from logs.structured import neutralise

    changed = ", ".join(f"{name} = {value}" for name, value in report["changed"].items()) or "nothing"
    print(f"changed: {changed}")
    print(f"{report['observations']} observations, {report['objects']} objects ({report['objects_before']} before)")
    if report["rooms"]:
        print("rooms: " + neutralise(", ".join(f"{room['name']} {room['objects']}" for room in report["rooms"])))
        print(f"{len(report['moved'])} objects stand in another room than before")
    print(f"{report['memory']}, content hash {report['content_hash']}")
