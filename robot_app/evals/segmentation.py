"""Fixed-vocabulary segmentation against labelled points (PLY with x, y, z, label) and their class names.

Reports the HOV-SG and the DualMap protocol side by side; they differ in what they ignore and in mIoU's divisor.
"""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from openbelief.memory import ObjectMemory

PROJECTIONS = ("visual", "consensus", "early", "full")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("memory", type=Path, metavar="SITE.belief")
    parser.add_argument("labels", type=Path, metavar="LABELS.ply")
    parser.add_argument("classes", type=Path, metavar="CLASSES.txt", help="one class a line, from class 0")
    parser.add_argument("--readout", choices=PROJECTIONS, help="one projection (default: all that the memory allows)")


def run(options: argparse.Namespace) -> None:
    from robot_app.memories import open_with_encoder

    memory = open_with_encoder(options.memory)
    aligned = PROJECTIONS if memory.feature_text_aligned else ("consensus", "early")
    readouts = (options.readout,) if options.readout else aligned
    try:
        rows = _evaluate(memory, options.labels, options.classes, readouts)
    except (OSError, ValueError) as error:
        raise Failure(str(error)) from error
    result = {
        "readouts": rows,
        "memory": str(options.memory),
        "labels": str(options.labels),
        "content_hash": memory.content_hash,
        "parameters": memory.parameters.to_dict(),
    }
    print_json(result) if options.json else _show(result)


def _evaluate(memory: ObjectMemory, labels: Path, classes: Path, readouts: tuple[str, ...]) -> dict[str, Any]:
    from openbelief.evaluation.labelled_points import read_classes, read_labelled_points
    from openbelief.evaluation.segmentation import evaluate

    names = read_classes(classes)
    points, truth = read_labelled_points(labels, len(names))
    rows = {}
    for readout in readouts:
        scores = evaluate(memory, names, points, truth, readout)
        rows[readout] = {protocol: dataclasses.asdict(s) for protocol, s in scores.items()}
    return rows


def _show(result: dict[str, Any]) -> None:
    from rich.table import Table

    from robot_app.tables import cell, number, show

    table = Table("readout", "protocol", "mIoU", "F-mIoU", "mAcc", title=cell(Path(result["labels"]).name))
    for readout, protocols in result["readouts"].items():
        for protocol, s in protocols.items():
            table.add_row(readout, protocol, *(number(s[k], 4) for k in ("miou", "fmiou", "macc")))
    show(table)
    print(f"memory {cell(result['memory'])}, content hash {result['content_hash']}")
