"""Live: one mission after the other, typed at a prompt, until an empty line or the end of input.

Every mission is recorded as a trial. Type stop at any time to stop the robot; Ctrl-C stops the mission under way, and
ends the program where none is. This is a software stop over a network: the hand-held remote is the emergency stop.
"""

from __future__ import annotations

import argparse
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from robot_app.mission.missions import Missions
    from robot_app.mission.operator import Operator

EXAMPLE = "openbelief run --config demo-out/robot.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--config", type=Path, default=Path("robot.toml"), metavar="robot.toml", help="default robot.toml"
    )


def run(options: argparse.Namespace) -> int:
    from drivers.ports import PortError
    from openbelief.store import BeliefFileError
    from robot_app.config import ConfigError, load_config
    from robot_app.mission.missions import open_missions
    from robot_app.mission.operator import Operator
    from robot_app.mission.terminal import Terminal
    from robot_app.signals import signals_stop

    try:
        config = load_config(options.config)
        operator = Operator()
        with (
            Terminal(operator, who=config.recording.operator),
            signals_stop(operator) as heard,
            open_missions(config, operator) as missions,
        ):
            if not heard:
                operator.tell(f"Ready over {config.memory}. Ask for a thing; an empty line ends.")
                _missions(missions, operator, heard, as_json=options.json)
    except (ConfigError, PortError, BeliefFileError, OSError) as error:
        raise Failure(str(error)) from error
    return 0


def _missions(missions: Missions, operator: Operator, heard: list[int], *, as_json: bool) -> None:
    """heard: the signals so far; Ctrl-C ends a mission, the others the program too."""
    while not any(number != signal.SIGINT for number in heard) and (sentence := operator.next_sentence()):
        operator.begin(sentence)
        try:
            recorded = missions.ask(sentence.text, who=sentence.who, how=sentence.how)
        except ValueError as error:
            print(f"openbelief run: {error}", file=sys.stderr)
            continue
        finally:
            operator.ended()
        operator.tell(f"trial: {recorded.failure or recorded.trial}")
        if as_json:
            print_json({"query": sentence.text} | recorded.as_json())
