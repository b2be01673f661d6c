"""The check on arrival against ground truth: how often right and wrong candidates are confirmed, by either check.

Every third frame is kept out of mapping and serves as an arrival wherever it shows a candidate's place. true:
candidates inside an accepted object's box. wrong: the five best-ranked others. unmapped: the same wrong ones, as if the
right things stood on no map. "paper" is the fixed threshold tau_q, "relative" asks the map again with what is seen.
Both thresholds are swept; --plot draws the curves. Cases of one query are not independent: the intervals are narrow.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from robot_app.cli import Failure, print_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("memory", type=Path, metavar="SITE.belief")
    parser.add_argument("recording", type=Path, metavar="WALK.mcap", help="the one that the memory was mapped from")
    parser.add_argument("truth", type=Path, metavar="TRUTH.json")
    parser.add_argument("--rooms", type=Path, metavar="ROOMS.json", help="rooms for this evaluation, as `map --rooms`")
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="the curves of both checks")


def run(options: argparse.Namespace) -> None:
    from logs.frames.reader import ReadOptions, frame_readers
    from logs.mcap_io.reader import LogError
    from openbelief.evaluation.truth import TruthError, read_truth
    from openbelief.evaluation.verification import evaluate
    from robot_app.evals.plots import plot_verification
    from robot_app.memories import open_with_encoder
    from robot_app.progress import progress
    from robot_app.room_files import read_rooms

    try:
        truth, memory = read_truth(options.truth), open_with_encoder(options.memory)
        if options.rooms:
            memory = memory.with_rooms(read_rooms(options.rooms))
        frames = (frame for reader in frame_readers([options.recording], ReadOptions()) for frame in reader)
        with progress() as shown:
            result = evaluate(memory, truth, frames, lambda n, total: shown.frames("queries", n, total))
    except (TruthError, LogError, OSError, ValueError) as error:
        raise Failure(str(error)) from error
    result |= {"memory": str(options.memory), "truth": str(options.truth), "content_hash": memory.content_hash}
    if options.plot:
        plot_verification(result, options.plot)
        result["plot"] = str(options.plot)
    print_json(result) if options.json else _show(result)


def _show(result: dict[str, Any]) -> None:
    from robot_app.tables import cell, number, show

    show(_table(result))
    cases = ", ".join(f"{count} {kind}" for kind, count in result["cases"].items())
    print(f"text encoder {cell(result['text_encoder'])}")
    print(f"{result['queries']} queries, {result['arrival_frames']} arrival frames, cases: {cases}")
    for name, curve in result["curves"].items():
        print(f"{name}, confirmed of {', '.join(result['cases'])} at other thresholds:")
        for point in curve:
            print(f"  {point['at']:.2f}: " + " ".join(number(point[kind], 2) for kind in result["cases"]))
    print(f"memory {cell(result['memory'])}, content hash {result['content_hash']}")


def _table(result: dict[str, Any]) -> Any:
    from rich.table import Table

    from robot_app.tables import cell, number

    title = f"confirmed, 95 % interval: {Path(result['truth']).name}"
    table = Table("check", "at", *result["cases"], title=cell(title), title_justify="left")
    for name, check in result["checks"].items():
        row = []
        for kind in result["cases"]:
            interval = check[kind]["interval"]
            between = "" if interval is None else f" ({interval[0]:.2f}-{interval[1]:.2f})"
            row.append(f"{number(check[kind]['confirmed'], 2)}{between}")
        table.add_row(name, number(check["at"], 2), *row)
    return table
