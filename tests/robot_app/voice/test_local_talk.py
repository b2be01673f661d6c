"""`run --voice`: Enter listens, Enter understands, ask asks; a stop stops, and nothing is said meanwhile."""

from __future__ import annotations

import pytest

from robot_app.cli import Failure
from robot_app.mission.operator import SharedOperator
from robot_app.voice.listener import Listener
from robot_app.voice.local_talk import LocalTalk

from .conftest import ScriptedRecogniser, clip, silence, tone


class Recorded:
    """A microphone's fake body."""

    def __init__(self) -> None:
        self.failure = ""

    def start(self) -> None:
        if self.failure:
            raise Failure(self.failure)

    def stop(self) -> bytes:
        return clip(silence(0.4), tone(0.6), silence(0.4)).pcm16()


@pytest.fixture
def operator() -> SharedOperator:
    made = SharedOperator()
    made.join("terminal")
    made.take("ada", "terminal")
    return made


def talk(
    operator: SharedOperator, words: str, kept: list, muted: list, microphone: Recorded | None = None
) -> LocalTalk:
    listener = Listener(ScriptedRecogniser(words))
    return LocalTalk(operator, microphone or Recorded(), listener, kept.append, muted.append)


def test_what_was_heard_is_asked_only_when_the_operator_says_so(operator):
    kept, muted = [], []
    mine = talk(operator, "go to the sofa", kept, muted)
    mine.turn()
    assert muted == [True]
    mine.turn()
    assert muted == [True, False] and operator.waiting == ()
    mine.ask()
    [sentence] = operator.waiting
    assert sentence.text == "go to the sofa" and sentence.notes[0].record.transcript == "go to the sofa"
    mine.ask()
    assert len(operator.waiting) == 1


def test_a_spoken_stop_stops_at_once_and_is_kept(operator):
    kept = []
    mine = talk(operator, "Stop!", kept, [])
    mine.turn()
    mine.turn()
    assert operator.stop_requested().because == "the operator said stop" and kept[0].record.asked == "stop"


def test_a_microphone_that_cannot_be_opened_is_said_and_listening_ends(operator):
    microphone, told, muted = Recorded(), [], []
    microphone.failure = "the microphone cannot be opened: no device"
    operator.listen(lambda notice: told.append(notice.sentence))
    talk(operator, "", [], muted, microphone).turn()
    assert told == [microphone.failure] and muted == [True, False]
