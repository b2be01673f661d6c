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
    return LocalTalk(
        operator,
        microphone or Recorded(),
        Listener(ScriptedRecogniser(words)),
        ask=lambda text, notes: operator.ask(operator.lease, text, notes),
        note=kept.append,
        who="ada",
        quiet=muted.append,
        beside=lambda act: act(),
    )


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
    stop = operator.stop_requested()
    assert (stop.because, stop.who, stop.how) == ("the operator said stop", "ada", "voice")
    assert kept[0].record.asked == "stop"


def test_what_was_said_is_understood_beside_so_that_a_typed_stop_does_not_wait(operator):
    waiting: list = []
    mine = LocalTalk(
        operator,
        Recorded(),
        Listener(ScriptedRecogniser("go to the sofa")),
        ask=lambda *_: None,
        note=lambda _: None,
        beside=waiting.append,
    )
    for _ in range(3):  # the third listens again while the first utterance is still being understood
        mine.turn()
    [understand] = waiting
    understand()
    assert operator.stop_requested() is None


def test_a_microphone_that_cannot_be_opened_is_said_and_listening_ends(operator):
    microphone, told, muted = Recorded(), [], []
    microphone.failure = "the microphone cannot be opened: no device"
    operator.listen(lambda notice: told.append(notice.sentence))
    talk(operator, "", [], muted, microphone).turn()
    assert told == [microphone.failure] and muted == [True, False]
