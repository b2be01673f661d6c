"""`openbelief ask --remote --audio`: what a recording says, corrected by hand before it is asked over there."""

from __future__ import annotations

import sys
from pathlib import Path

from logs.structured import neutralise
from robot_app.cli import Failure
from robot_app.config import Config
from robot_app.mission.command_replies import is_stop
from robot_app.mission.terminal import STOP_WORDS
from robot_app.remote.client import RemoteOperator
from robot_app.voice import asking


def heard(audio: Path, config: Config, operator: RemoteOperator, who: str, *, may_correct: bool) -> str:
    """What the recording says; a stop stops the robot there. Raises Failure then, and where nothing was said."""
    utterance = asking.SpokenFile.open(audio, config.voice).understood()
    if utterance.stop:
        operator.stop(who)
    asking.show(utterance, _to_screen)
    return _typed_instead(operator, who) or utterance.transcript if may_correct else utterance.transcript


def _to_screen(line: str) -> None:
    print(neutralise(line), file=sys.stderr, flush=True)


def _typed_instead(operator: RemoteOperator, who: str) -> str:
    """What the person at this terminal types instead, "" for Enter. Raises Failure: a stop, or the input has ended."""
    _to_screen(asking.CORRECT)
    line = next(iter(sys.stdin), None)
    if line is None:
        raise Failure("nothing was asked: the input has ended")
    if (word := line.strip().lower().rstrip("!.")) in STOP_WORDS or is_stop(line):
        operator.stop(who)
        raise Failure(asking.A_TYPED_STOP.format(word=word))
    return line.strip()
