"""One mission, from the terminal: ask for a thing, approve the drive, watch what the robot finds.

The robot, its memory and its perception come from --config. Motion needs your yes unless the configuration says
otherwise; type stop (or press Ctrl-C) at any time. Exit status 0: CONFIRMED. 1: any other end, which is named.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from robot_app.cli import Failure, print_json

EXAMPLE = 'openbelief ask "take me to the fire extinguisher" --config demo-out/robot.toml'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("sentence", help="what to look for, in plain words")
    parser.add_argument(
        "--config", type=Path, default=Path("robot.toml"), metavar="robot.toml", help="default robot.toml"
    )
    parser.add_argument("--yes", action="store_true", help="approve motion now, for every candidate of this mission")
    parser.add_argument("--trial", type=Path, metavar="FILE.mcap", help="where to record (default: the trials folder)")


def run(options: argparse.Namespace) -> int:
    from drivers.ports import PortError
    from logs.structured import neutralise
    from openbelief.store import BeliefFileError
    from robot_app.config import ConfigError, load_config
    from robot_app.mission.missions import open_missions
    from robot_app.mission.operator import Operator
    from robot_app.mission.terminal import HOW, Terminal
    from robot_app.signals import signals_stop

    try:
        config = load_config(options.config)
        operator = Operator(approve_all="approved with --yes" if options.yes else "")
        with (
            Terminal(operator, who=config.recording.operator) as terminal,
            signals_stop(operator),
            open_missions(config, operator) as missions,
        ):
            recorded = missions.ask(options.sentence, options.trial, who=terminal.who, how=HOW)
    except (ConfigError, PortError, BeliefFileError, OSError, ValueError) as error:
        raise Failure(str(error)) from error
    outcome = recorded.outcome
    if options.json:
        print_json(recorded.as_json())
    else:
        if not (sys.stdout.isatty() and sys.stderr.isatty()):  # a person at a terminal has just been told
            print(neutralise(f"{outcome.end}: {outcome.reason}"))
        print(neutralise(f"trial: {recorded.failure or recorded.trial}"))
    return 0 if outcome.end == "CONFIRMED" else 1
