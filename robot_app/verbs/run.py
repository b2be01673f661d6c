"""Live: one mission after the other, typed at a prompt or asked for on a page, until an empty line or the end of input.

Every mission is recorded as a trial. Type stop at any time to stop the robot; Ctrl-C stops the mission under way, and
ends the program where none is. This is a software stop over a network: the hand-held remote is the emergency stop.

With --console a page shows camera, plan, candidates and evidence, and commands the robot from a browser; the terminal
prints a link that logs one browser in, once (type pair, or pair viewer, for another one). It listens at this machine
only, unless a host is named; that needs a certificate (openbelief certs) and an account (openbelief accounts).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import Failure, Usage, print_json

if TYPE_CHECKING:
    from robot_app.config import Config
    from robot_app.console.server import Listening

EXAMPLE = "openbelief run --config demo-out/robot.toml --console 8800"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--config", type=Path, default=Path("robot.toml"), metavar="robot.toml", help="default robot.toml"
    )
    parser.add_argument("--voice", action="store_true", help="speak at this machine's microphone (docs/voice.md)")
    parser.add_argument(
        "--console", type=listening, metavar="[HOST:]PORT", help="serve the page (port 0: any free one)"
    )


def run(options: argparse.Namespace) -> int:
    from drivers.ports import PortError
    from openbelief.store import BeliefFileError
    from robot_app.config import ConfigError, load_config

    try:
        config = load_config(options.config)
        if options.voice:
            if options.console is not None:
                raise Usage("--voice is for the terminal; the page has a talk button of its own")
            _by_voice(config, as_json=options.json)
        elif options.console is None:
            _at_the_terminal(config, as_json=options.json)
        else:
            with_console(config, options.console, as_json=options.json)
    except (ConfigError, PortError, BeliefFileError, OSError) as error:
        raise Failure(str(error)) from error
    return 0


def listening(text: str) -> Listening:
    """[HOST:]PORT of an argument."""
    from robot_app.console.server import listening_of

    try:
        return listening_of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _at_the_terminal(config: Config, *, as_json: bool) -> None:
    from robot_app.mission.distance_line import DistanceLine
    from robot_app.mission.live import run_missions
    from robot_app.mission.missions import open_missions
    from robot_app.mission.operator import SharedOperator
    from robot_app.mission.terminal import Terminal
    from robot_app.remote.service import open_remote
    from robot_app.signals import signals_stop

    operator = SharedOperator()
    with (
        Terminal(operator, who=config.recording.operator),
        signals_stop(operator) as heard,
        open_missions(config, operator) as missions,
    ):
        if not heard:
            operator.tell(f"Ready over {config.memory}. Ask for a thing; an empty line ends.")
            with open_remote(config, operator, missions) as watching:
                run_missions(
                    missions,
                    operator,
                    heard,
                    report=print_json if as_json else None,
                    watching=(DistanceLine(sys.stderr), *watching),
                )


def _by_voice(config: Config, *, as_json: bool) -> None:
    """The terminal, where an empty line begins to listen and the next one ends it."""
    from robot_app.mission.distance_line import DistanceLine
    from robot_app.mission.live import run_missions
    from robot_app.mission.missions import open_missions
    from robot_app.mission.operator import SharedOperator
    from robot_app.mission.terminal import Terminal
    from robot_app.remote.service import open_remote
    from robot_app.signals import signals_stop
    from robot_app.voice.listener import Listener
    from robot_app.voice.local_talk import LocalTalk
    from robot_app.voice.microphone import LocalMicrophone
    from robot_app.voice.recognisers import open_recogniser
    from robot_app.voice.speaking import Speaker, local_voice
    from robot_app.voice.suggestions import memory_phrases

    voice, operator = config.voice, SharedOperator()
    recogniser, microphone = open_recogniser(voice.recogniser, voice.language), LocalMicrophone(voice.microphone)
    with (
        signals_stop(operator) as heard,
        open_missions(config, operator) as missions,
        open_remote(config, operator, missions) as watching,
        Speaker(operator, local_voice(voice)) as speaker,
    ):
        listener = Listener(recogniser, memory_phrases(missions.memory))
        talk = LocalTalk(
            operator,
            microphone,
            listener,
            ask=lambda words, notes: terminal.ask(words, notes),
            note=missions.note,
            who=config.recording.operator,
            quiet=speaker.quiet,
        )
        more = {"": talk.turn, "ask": talk.ask, "end": operator.end}
        with Terminal(operator, who=config.recording.operator, more=more) as terminal:
            operator.tell(f"Ready over {config.memory}. Press Enter to speak, and again to end; type end to leave.")
            run_missions(
                missions,
                operator,
                heard,
                report=print_json if as_json else None,
                watching=(DistanceLine(sys.stderr), *watching),
            )


def with_console(config: Config, listening: Listening, *, as_json: bool) -> None:
    """The page's missions ask a person before motion, whatever the configuration allows: one is there."""
    from dataclasses import replace

    from robot_app.console.accounts import Accounts
    from robot_app.console.console import open_console
    from robot_app.console.invitation import Invitation
    from robot_app.console.server import checked
    from robot_app.mission.live import run_missions
    from robot_app.mission.missions import open_missions
    from robot_app.mission.operator import SharedOperator
    from robot_app.mission.terminal import Terminal
    from robot_app.remote.service import open_remote
    from robot_app.signals import signals_stop
    from robot_app.wall_time_robot import in_wall_time

    checked(listening, config.console, Accounts(config.console.accounts))  # before a robot is opened
    asking = config.model_copy(update={"mission": replace(config.mission, motion="ask")})
    operator = SharedOperator()
    with (
        signals_stop(operator) as heard,
        in_wall_time(asking) as reached,
        open_missions(reached, operator, kept=asking) as missions,
        open_console(listening, reached, operator, missions) as console,
        open_remote(reached, operator, missions) as watching,
    ):
        invite = Invitation(console.server, config.recording.operator or "operator")
        more = {"pair": invite.operator, "pair viewer": invite.viewer}
        with Terminal(operator, who=config.recording.operator, where_empty=invite.again, more=more, commands=False):
            if not heard:
                invite.operator()
                report = print_json if as_json else None
                run_missions(missions, operator, heard, report=report, watching=(console.live, *watching))
