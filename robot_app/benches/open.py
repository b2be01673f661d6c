"""Opening a .belief file of many objects, in a process of its own: CPU time and memory until it is open, has answered,
and has given one object's points; beside it every observation read and hashed, as a textbook would.

The file is made first, from a seed: 4 views of 150 points an object by default, features of 512 numbers.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from robot_app.benches.cpu import count
from robot_app.cli import Failure, print_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--objects", type=count, nargs="+", default=[10_000], metavar="N", help="sizes of the memory (default 10000)"
    )
    parser.add_argument("--views", type=count, default=4, metavar="N", help="observations of an object (default 4)")
    parser.add_argument("--points", type=count, default=150, metavar="N", help="points of an observation (default 150)")


def run(options: argparse.Namespace) -> None:
    rows = [_measured(size, options.views, options.points) for size in sorted(options.objects)]
    print_json({"files": rows}) if options.json else print("\n".join(_line(row) for row in rows))
    if not all(row["equal"] for row in rows):
        raise Failure("the file holds other observations than were written: that is a defect, please report it")


def _measured(objects: int, views: int, points: int) -> dict[str, Any]:
    from openbelief import saved_file
    from openbelief.node_columns import believe
    from robot_app.benches.synthetic_memory import evidence

    with tempfile.TemporaryDirectory() as folder:
        path, made = Path(folder) / "site.belief", evidence(objects, views, points)
        saved_file.write(path, made, believe(made))
        command = [sys.executable, "-m", "robot_app.benches.opened", str(path)]
        child = subprocess.run(command, capture_output=True, text=True, check=False)
        if child.returncode:
            raise Failure(f"the file that was made could not be opened: {child.stderr.strip().splitlines()[-1]}")
        row: dict[str, Any] = json.loads(child.stdout)
        return row | {"file_mb": path.stat().st_size >> 20}


def _line(row: dict[str, Any]) -> str:
    return (
        f"{row['objects']} objects, {row['observations']} observations, {row['file_mb']} MB: open in "
        f"{row['open_cpu_s']:.3g} s of CPU (+{row['opened_mb']} MB), first answer {row['first_answer_cpu_s']:.3g} s "
        f"(+{row['answered_mb']} MB), one object's {row['points']} points {1e3 * row['one_object_cpu_s']:.2g} ms; "
        f"all of it read plainly {row['plain_cpu_s']:.3g} s (+{row['plain_mb']} MB), {row['ratio']:g}x"
    )
