"""Are objects in the right rooms? A memory's rooms against the true ones of a TRUTH.json, matched one to one.

Map without --rooms to score the rooms that the map shows; each object counts once, walls and floors not at all.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from robot_app.cli import Failure, print_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("memory", type=Path, metavar="SITE.belief")
    parser.add_argument("truth", type=Path, metavar="TRUTH.json", help='holds "rooms", each with name and polygon')


def run(options: argparse.Namespace) -> None:
    from openbelief.evaluation.rooms import evaluate_rooms
    from openbelief.evaluation.truth import TruthError, read_truth
    from robot_app.memories import open_memory
    from robot_app.room_files import read_rooms

    try:
        truth = read_truth(options.truth)
    except TruthError as error:
        raise Failure(str(error)) from error
    memory = open_memory(options.memory)
    result = evaluate_rooms(memory, read_rooms(options.truth), truth.objects)
    if not result["objects"]:
        raise Failure(f"No object of {options.memory} stands in a room of {options.truth}: is it of another site?")
    print_json(result | {"memory": str(options.memory)}) if options.json else _show(result)


def _show(result: dict[str, Any]) -> None:
    from robot_app.tables import cell

    found = f"{result['rooms_found']} rooms ({result['given']} of them given) for {result['rooms']} true ones"
    print(f"{result['right']:.1%} of {result['objects']} objects are in the right room; {found}")
    if any(result["named"].values()):
        print("derived rooms' names: " + ", ".join(f"{count} {how}" for how, count in result["named"].items()))
    for name, true in result["matched"].items():
        print(f"  {cell(name)} is {cell(true)}")
    for wrong in result["wrong"]:
        where = wrong["room"] or "no room"
        print(cell(f"  object {wrong['object']} ({wrong['label'] or '-'}): in {where}, truly in {wrong['true']}"))
