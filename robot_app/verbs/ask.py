"""One mission, from the terminal: ask for a thing, approve the drive, watch what the robot finds.

The robot, its memory and its perception come from --config. Motion needs your yes unless the configuration says
otherwise; type stop (or press Ctrl-C) at any time. With --audio a recording asks: what was heard is shown, and at a
terminal you may type what you meant before it is asked. With --remote the mission is that of an `openbelief run` that
takes commands over Zenoh ([remote] in its robot.toml). Exit status 0: CONFIRMED. 1: any other end, which is named.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import Failure, Usage, print_json

if TYPE_CHECKING:
    from robot_app.mission.missions import RecordedMission
    from robot_app.mission.operator import SharedOperator
    from robot_app.voice.listener import Utterance

EXAMPLE = 'openbelief ask "take me to the fire extinguisher" --config demo-out/robot.toml'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("sentence", nargs="?", help="what to look for, in plain words")
    parser.add_argument("--audio", type=Path, metavar="FILE.wav", help="a recording that asks, instead of a sentence")
    parser.add_argument(
        "--config", type=Path, default=Path("robot.toml"), metavar="robot.toml", help="default robot.toml"
    )
    parser.add_argument("--yes", action="store_true", help="approve motion now, for every candidate of this mission")
    parser.add_argument("--insist", action="store_true", help="drive there although the map may hold no such thing")
    parser.add_argument("--remote", action="store_true", help="command an openbelief run that is under way elsewhere")
    parser.add_argument("--take-over", action="store_true", help="with --remote: also where somebody else commands")
    parser.add_argument("--who", metavar="NAME", help="with --remote: who asks (default: the user)")
    parser.add_argument("--trial", type=Path, metavar="FILE.mcap", help="where to record (default: the trials folder)")


def run(options: argparse.Namespace) -> int:
    from drivers.ports import PortError
    from openbelief.store import BeliefFileError
    from robot_app.config import ConfigError

    if (options.sentence is None) == (options.audio is None):
        raise Usage("say what to look for, or name a recording with --audio: one of both")
    if options.remote and options.insist:
        raise Usage("--insist is said where the robot is commanded: answer its question there")
    if options.remote and options.trial:
        raise Usage("--trial is where this machine records; with --remote the other end does")
    if (options.take_over or options.who) and not options.remote:
        raise Usage("--take-over and --who are for --remote")
    if options.remote:
        return _remote(options)
    try:
        recorded, utterance = _mission(options)
    except (ConfigError, PortError, BeliefFileError, OSError, ValueError) as error:
        raise Failure(str(error)) from error
    _report(options, recorded, utterance)
    return 0 if recorded.outcome.end == "CONFIRMED" else 1


def _mission(options: argparse.Namespace) -> tuple[RecordedMission, Utterance | None]:
    from robot_app.config import load_config
    from robot_app.mission.distance_line import DistanceLine
    from robot_app.mission.missions import open_missions
    from robot_app.mission.operator import SharedOperator
    from robot_app.mission.terminal import HOW, Terminal
    from robot_app.signals import signals_stop
    from robot_app.voice import asking

    config = load_config(options.config)
    if options.yes:  # nobody is there to ask about a doubt
        config = config.model_copy(update={"mission": replace(config.mission, doubt="refuse")})
    recording = asking.SpokenFile.open(options.audio, config.voice) if options.audio else None
    operator = SharedOperator(approve_all="approved with --yes" if options.yes else "")
    correction = _Correction(operator)
    with (
        Terminal(
            operator, who=config.recording.operator, where_empty=correction.accept, under_way=lambda: True
        ) as terminal,
        signals_stop(operator),
        open_missions(config, operator) as missions,
    ):
        sentence, utterance = options.sentence, recording.understood(missions.memory) if recording else None
        if utterance is not None:
            asking.show(utterance, operator.tell)
            may_correct = sys.stdin.isatty() and not options.yes
            sentence = correction.corrected(utterance.transcript) if may_correct else utterance.transcript
        recorded = missions.ask(
            sentence,
            options.trial,
            who=terminal.who,
            how=asking.HOW if utterance else HOW,
            notes=asking.notes_of(utterance, sentence),
            watching=[DistanceLine(terminal.screen)],
            insist=options.insist,
        )
        return recorded, utterance


def _remote(options: argparse.Namespace) -> int:
    import getpass

    from drivers.ports import PortError
    from drivers.ros.zenoh_link import ZenohLink
    from logs.structured import neutralise
    from robot_app.config import ConfigError, load_config
    from robot_app.mission.lease import Refused
    from robot_app.remote.asking import RemoteAsking
    from robot_app.remote.client import RemoteOperator
    from robot_app.remote.service import link_config

    try:
        config = load_config(options.config)
        who = options.who or config.recording.operator or getpass.getuser()
        namespace = config.zenoh.namespace
        with (
            ZenohLink(link_config(config)) as link,
            RemoteOperator(link, who, namespace, over=options.take_over) as operator,
        ):
            may_correct = sys.stdin.isatty() and not options.yes
            sentence = options.sentence
            if sentence is None:
                from robot_app.remote.hearing import heard

                sentence = heard(options.audio, config, operator, who, may_correct=may_correct)
            outcome = RemoteAsking(operator, who, approve=options.yes).run(sentence)
    except (ConfigError, PortError, Refused, ValueError) as error:
        hint = " (--take-over does)" if isinstance(error, Refused) and "take over" in str(error) else ""
        raise Failure(f"{error}{hint}") from error
    if options.json:
        print_json({"outcome": outcome["end"], **{key: outcome[key] for key in outcome if key not in ("end", "order")}})
    else:
        print(neutralise(f"{outcome['end']}: {outcome['reason']}"))
    return 0 if outcome["end"] == "CONFIRMED" else 1


class _Correction:
    """What was heard stands until somebody types something else; an empty line takes it."""

    def __init__(self, operator: SharedOperator) -> None:
        self._operator, self._heard = operator, ""

    def accept(self) -> None:
        """An empty line: the heard sentence is asked; without one the input means nothing."""
        if self._heard:
            self._operator.ask(self._operator.lease, self._heard)

    def corrected(self, heard: str) -> str:
        """Raises Failure where the input ended instead."""
        from robot_app.voice import asking

        self._heard = heard
        self._operator.tell(asking.CORRECT)
        sentence = self._operator.next_sentence()
        self._heard = ""
        if sentence is None:
            raise Failure("nothing was asked: the input has ended")
        return sentence.text


def _report(options: argparse.Namespace, recorded: RecordedMission, utterance: Utterance | None) -> None:
    from logs.structured import neutralise
    from robot_app.voice.asking import utterance_json

    outcome = recorded.outcome
    if options.json:
        heard = {"heard": utterance_json(utterance)} if utterance else {}
        print_json(recorded.as_json() | heard)
        return
    if not (sys.stdout.isatty() and sys.stderr.isatty()):  # a person at a terminal has just been told
        print(neutralise(f"{outcome.end}: {outcome.reason}"))
    print(neutralise(f"trial: {recorded.failure or recorded.trial}"))
