"""Whole missions in simulation, as many seeds, by either check on arrival: how often each is right and wrong.

The scene is walked once; every seed maps that walk with its own perception and runs one mission, the findable queries
of the scene in turn, with an operator who says yes. A simulated clock passes as fast as the computer allows. What was
run already in the folder is not run again, so an interrupted evaluation goes on. Simulated results, not a robot's.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app import arguments
from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from robot_app.evals.mission_runs import MissionRun


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--seeds", type=arguments.from_one, default=40, metavar="N", help="missions 1 to N (default 40)"
    )
    parser.add_argument("--arrival-check", choices=("relative", "paper", "both"), default="both", help="default both")
    parser.add_argument("--scene", default="flat", metavar="SCENE.json", help="a scene file, or a built-in one (flat)")
    parser.add_argument("--out", type=Path, default=Path("eval-missions"), metavar="DIR", help="default eval-missions")


def run(options: argparse.Namespace) -> None:
    from drivers.ports import PortError
    from robot_app.evals.mission_runs import CHECKS, MissionRuns
    from robot_app.progress import progress
    from sim_fakes.world.scene import SceneError

    checks = CHECKS if options.arrival_check == "both" else (options.arrival_check,)
    try:
        with progress() as shown:
            missions = MissionRuns(options.out, options.scene, shown)
            runs = missions.run(range(1, options.seeds + 1), checks, lambda run: shown.step(_line(run)))
    except (PortError, SceneError, OSError, ValueError, RuntimeError) as error:
        raise Failure(str(error)) from error
    result = {
        "scene": options.scene,
        "seeds": options.seeds,
        "folder": str(options.out),
        "checks": {check: summary([run for run in runs if run.check == check]) for check in checks},
        "missions": [vars(run) for run in runs],
    }
    print_json(result) if options.json else _show(result, runs)


def summary(runs: list[MissionRun]) -> dict[str, Any]:
    """Counts over the missions of one check, each with its share's 95 % Wilson interval."""
    from openbelief.evaluation.statistics import wilson

    counts = {
        "confirmed_right": sum(run.right is True for run in runs),
        "confirmed_false": sum(run.right is False for run in runs),
        "confirmed_over_1_m_away": sum(run.far is True for run in runs),
        "rejected_right": sum(run.rejected_right > 0 for run in runs),
        "nothing_confirmed": sum(run.right is None for run in runs),
    }
    n = len(runs)
    told = {name: {"missions": k, "interval": list(wilson(k, n)) if n else None} for name, k in counts.items()}
    visits = sum(run.visits for run in runs) / n if n else None
    return {"missions": n, **told, "visits": visits, "not_mapped": sum(not run.mapped for run in runs)}


def _line(run: MissionRun) -> str:
    confirmed = {None: "nothing confirmed", True: "right", False: "FALSE"}[run.right]
    rejected = f", {run.rejected_right} right rejected" if run.rejected_right else ""
    return f"seed {run.seed}, {run.check}: {run.query!r}: {confirmed}{rejected}, {run.visits} visits ({run.reason})"


def _show(result: dict[str, Any], runs: list[MissionRun]) -> None:
    from rich.table import Table

    from robot_app.tables import cell, number, show

    title = f"{result['scene']}, simulated, {result['seeds']} seeds; 95 % intervals"
    columns = {
        "confirmed_right": "right",
        "confirmed_false": "false",
        "confirmed_over_1_m_away": "false, over 1 m",
        "rejected_right": "right one rejected",
        "nothing_confirmed": "none",
    }
    table = Table("check", "missions", *columns.values(), "visits", title=cell(title), title_justify="left")
    for check, row in result["checks"].items():
        cells = []
        for name in columns:
            interval = row[name]["interval"]
            between = f" ({interval[0]:.2f}-{interval[1]:.2f})" if interval else ""
            cells.append(f"{row[name]['missions']}{between}")
        table.add_row(check, str(row["missions"]), *cells, number(row["visits"], 2))
    for run in runs:
        if run.right is not True or run.rejected_right:
            print(cell(_line(run)))
    show(table)
    unmapped = max((row["not_mapped"] for row in result["checks"].values()), default=0)
    print(f"not on the map at all: {unmapped} of each check's missions; trials and maps: {cell(result['folder'])}")
