"""Look at everything that a mission needs, and say of each part ok, warn or fail, with the remedy.

robot.toml itself; disk, memory file and its encoder, models and GPU, certificates; then the robot that it names: link
and encryption, camera, lidar and its health codes, clocks, transforms, map, Nav2, watchdog, battery. Without a usable
robot.toml this machine is still looked at, and with the robot out of reach the sensors that are plugged in here. Moves
nothing. Exit status 1 where anything fails.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import print_json

if TYPE_CHECKING:
    from robot_app.doctor.finding import Finding

EXAMPLE = "openbelief doctor --config demo-out/robot.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--config", type=Path, default=Path("robot.toml"), metavar="robot.toml", help="default robot.toml"
    )


def run(options: argparse.Namespace) -> int:
    from drivers.clock import SystemClock
    from robot_app.doctor.examination import examine_file
    from robot_app.doctor.finding import Level

    lines = []
    for line in examine_file(options.config, SystemClock().now_ns()):
        lines.append(line)
        if not options.json:
            print(written(line), flush=True)
    failed = any(line.level == Level.FAIL for line in lines)
    if options.json:
        print_json({"ok": not failed, "checks": [vars(line) for line in lines]})
    return 1 if failed else 0


def written(line: Finding) -> str:
    """`fail  lidar: what is wrong`, and the remedy on a line of its own."""
    from logs.structured import neutralise

    remedy = f"\n      -> {line.remedy}" if line.remedy else ""
    return neutralise(f"{line.level:<5} {line.name}: {line.said}{remedy}", keep="\n")
