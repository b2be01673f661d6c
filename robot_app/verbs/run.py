"""Live: one mission after the other, typed at a prompt or asked for on a page, until an empty line or the end of input.

Every mission is recorded as a trial. Type stop at any time to stop the robot; Ctrl-C stops the mission under way, and
ends the program where none is. This is a software stop over a network: the hand-held remote is the emergency stop.

With --console a page shows camera, plan, candidates and evidence, and commands the robot from a browser; the terminal
prints a link that logs one browser in, once (type pair, or pair viewer, for another one). It listens at this machine
only, unless a host is named; that needs a certificate (openbelief certs) and an account (openbelief accounts).
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app import arguments
from robot_app.cli import Failure, Usage, print_json

if TYPE_CHECKING:
    from robot_app.config import Config

EXAMPLE = "openbelief run --config demo-out/robot.toml --console 8800"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--config", type=Path, default=Path("robot.toml"), metavar="robot.toml", help="default robot.toml"
    )
    parser.add_argument("--voice", action="store_true", help="speak at this machine's microphone (docs/voice.md)")
    parser.add_argument(
        "--console", type=arguments.listening, metavar="[HOST:]PORT", help="serve the page (port 0: any free one)"
    )


def run(options: argparse.Namespace) -> int:
    from drivers.ports import PortError
    from openbelief.store import BeliefFileError
    from robot_app.config import ConfigError, load_config

    try:
        config = load_config(options.config)
        if options.voice and options.console is not None:
            raise Usage("--voice is for the terminal; the page has a talk button of its own")
        _run_live(config, options)
    except (ConfigError, PortError, BeliefFileError, OSError) as error:
        raise Failure(str(error)) from error
    return 0


def _run_live(config: Config, options: argparse.Namespace) -> None:
    report = print_json if options.json else None
    if options.voice:
        from robot_app.voice.spoken_run import run_by_voice

        run_by_voice(config, report)
    elif options.console is not None:
        from robot_app.console.console_run import run_with_console

        run_with_console(config, options.console, report)
    else:
        from robot_app.mission.terminal_run import run_at_the_terminal

        run_at_the_terminal(config, report)
