"""Run a recorded trial's mission again from what it consumed, and compare decision by decision.

Ranking, goal poses, arrival checks and transitions are computed anew; sensors, navigation, operator and perception
answer as they did. Exit status 0: identical (the same discrete decisions, floats within 1e-6). 1: the first
difference is printed, with how far the values are apart.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from robot_app.cli import Failure, print_json

EXAMPLE = "openbelief replay demo-out/trial.mcap"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("trial", type=Path, metavar="TRIAL.mcap", help="a recorded trial")
    parser.add_argument("--memory", type=Path, help="the .belief file, where the trial names it only by its hash")


def run(options: argparse.Namespace) -> int:
    from logs.reader import LogError
    from logs.trial import TrialError
    from openbelief.store import BeliefFileError
    from robot_app.trials import replay_trial

    try:
        replayed = replay_trial(options.trial, options.memory)
    except (LogError, TrialError, BeliefFileError, ValueError, OSError) as error:
        raise Failure(str(error)) from error
    difference = replayed.difference
    if options.json:
        print_json(_as_json(options.trial, replayed))
    elif difference is None:
        print(f"identical: {len(replayed.decisions)} decisions, outcome {_outcome(replayed)}")
    else:
        print(f"different: {difference}")
    return 0 if difference is None else 1


def _outcome(replayed: Any) -> str:
    ended = replayed.trial.outcome
    return f"{ended.end} ({ended.reason})"


def _as_json(path: Path, replayed: Any) -> dict[str, Any]:
    difference = replayed.difference
    return {
        "trial": str(path),
        "replay": "identical" if difference is None else "different",
        "decisions": len(replayed.decisions),
        "outcome": replayed.trial.outcome.end,
        "difference": None if difference is None else _difference(difference),
    }


def _difference(difference: Any) -> dict[str, Any]:
    return {
        "step": difference.step,
        "decision": difference.decision,
        "record": difference.topic,
        "field": difference.field,
        "recorded": difference.recorded,
        "replayed": difference.replayed,
        "by": difference.by,
        "sentence": str(difference),
    }
