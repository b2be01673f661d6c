"""List recorded trials: when, what was asked, how it ended, and what became of each candidate.

A file that cannot be read is named with the reason; the others are still listed. Recordings of walks that lie in the
same folder are no trials, and are left out.
"""

from __future__ import annotations

import argparse
import shutil
import textwrap
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from robot_app.cli import Failure, print_json

EXAMPLE = "openbelief trials demo-out"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="DIR", help="a folder of trials (*.mcap)")


def run(options: argparse.Namespace) -> int:
    from robot_app.mission.trials import summaries

    if not options.folder.is_dir():
        raise Failure(f"{options.folder} is not a folder: name the one that [trials] in robot.toml says")
    found = list(summaries(options.folder))
    if options.json:
        print_json({"trials": [_as_json(summary) for summary in found]})
        return 0
    for summary in found:
        print(_entry(summary))
    if not found:
        print(f"no trials in {options.folder}")
    return 0


def _entry(summary: Any) -> str:
    """A trial in lines that fit a terminal: which, what was asked, how it ended, what was tried."""
    from logs.structured import neutralise

    if summary.broken:
        return _fitted(neutralise(f"{summary.path.name}: cannot be read: {summary.broken}"), "")
    tried = "; ".join(f"{label}: {verdict}" for label, verdict in summary.candidates) or "no candidate"
    simulated = "  simulated" if summary.simulated else ""
    head = f"{summary.path.name}  {_when(summary.started_ns)}{simulated}"
    lines = (f"{summary.sentence!r}: {summary.end}, visits {summary.visits}", summary.reason, tried)
    return "\n".join([neutralise(head), *(_fitted(neutralise(line), "  ") for line in lines if line)])


def _fitted(text: str, indent: str) -> str:
    width = shutil.get_terminal_size().columns
    return textwrap.fill(text, width, initial_indent=indent, subsequent_indent=indent or "  ")


def _when(stamp_ns: int) -> str:
    return datetime.fromtimestamp(stamp_ns / 1e9, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")


def _as_json(summary: Any) -> dict[str, Any]:
    if summary.broken:
        return {"trial": str(summary.path), "broken": summary.broken}
    return {
        "trial": str(summary.path),
        "started_ns": summary.started_ns,
        "query": summary.sentence,
        "outcome": summary.end,
        "reason": summary.reason,
        "visits": summary.visits,
        "simulated": summary.simulated,
        "candidates": [{"label": label, "verdict": verdict} for label, verdict in summary.candidates],
    }
