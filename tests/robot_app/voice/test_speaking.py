"""What the robot says aloud, when it is silent, and by which body."""

from __future__ import annotations

import io
import subprocess

import pytest

from robot_app.config_sections import VoiceSection
from robot_app.mission.notices import Change, Notice
from robot_app.mission.operator import SharedOperator
from robot_app.voice import speaking
from robot_app.voice.moments import LONGEST, said_aloud
from robot_app.voice.speaking import EspeakVoice, Silence, Speaker, local_voice

ALOUD = {
    "I walk to the sofa.": "I walk to the sofa.",
    "May I walk to the sofa in the room, 0.7 m away (mapped as 'couch'), and look at it?": (
        "May I walk to the sofa in the room, 0.7 m away, and look at it?"
    ),
    'CONFIRMED: "fire extinguisher" matches (0.86) at the stored place: overlap 100%.': (
        "Confirmed: fire extinguisher matches at the stored place: overlap 100%."
    ),
    "NAVIGATION FAILED: no candidate left": "Navigation failed: no candidate left",
    "Not found: nothing on the map is like 'clubs'; the nearest are armchair, bucket.": (
        "Not found: nothing on the map is like clubs; the nearest are armchair, bucket."
    ),
    "The agent helper asks for: don't know": "The agent helper asks for: don't know",
    "trial: /home/ada/trial_1.mcap": "",
    'Heard "go to the sofa" (confidence 0.83).': "",
    "Listening: press Enter when you have said it.": "",
    "Ready over site.belief. Ask for a thing; an empty line ends.": "",
    "Commands over Zenoh are taken at tcp/127.0.0.1:7450.": "",
    "": "",
}


@pytest.mark.parametrize(("sentence", "words"), ALOUD.items())
def test_what_matters_is_said_without_what_only_eyes_can_follow(sentence, words):
    assert said_aloud(Notice(Change.TOLD, sentence)) == words


@pytest.mark.parametrize("change", [Change.LEASE, Change.ANSWERED, Change.QUEUE, Change.MISSION])
def test_what_the_operators_did_themselves_is_not_said(change):
    assert said_aloud(Notice(change, "ada commands the robot now.")) == ""


def test_a_long_sentence_ends_at_the_end_of_a_part_and_a_part_at_the_end_of_a_word():
    assert said_aloud(Notice(Change.TOLD, f"Setting it aside. {'so ' * 60}")) == "Setting it aside."
    words = said_aloud(Notice(Change.TOLD, "on and " * 40))
    assert len(words) <= LONGEST + len(" ...") and words.endswith((" on ...", " and ..."))


class Kept:
    """A Voice's fake body."""

    def __init__(self) -> None:
        self.did: list[str] = []

    def say(self, words: str) -> None:
        self.did.append(words)

    def hush(self) -> None:
        self.did.append("(hush)")


def test_while_anybody_is_listened_to_nothing_is_said_and_nothing_is_said_later():
    operator, voice = SharedOperator(), Kept()
    with Speaker(operator, voice) as speaker:
        operator.tell("One.")
        speaker.quiet(True)
        speaker.quiet(True)
        operator.tell("Two.")
        speaker.quiet(False)
        operator.tell("Three.")
        speaker.quiet(False)
        operator.tell("Four.")
    operator.tell("Five.")
    assert voice.did == ["One.", "(hush)", "(hush)", "Four.", "(hush)"]


def test_a_stop_does_not_wait_for_what_is_being_said():
    operator, voice = SharedOperator(), Kept()
    with Speaker(operator, voice):
        operator.tell("This lamp is not confirmed.")
        operator.tell("I walk to the sofa.")
        operator.stop(because="ada said stop")
    assert voice.did == [
        "This lamp is not confirmed.",
        "I walk to the sofa.",
        "(hush)",
        "Stop: ada said stop.",
        "(hush)",
    ]


def test_the_body_is_espeak_where_it_is_installed_and_else_or_when_off_silence(monkeypatch):
    monkeypatch.setattr(speaking, "installed", lambda program: True)
    assert isinstance(local_voice(VoiceSection()), EspeakVoice)
    assert isinstance(local_voice(VoiceSection(speak="off")), Silence)
    monkeypatch.setattr(speaking, "installed", lambda program: False)
    assert isinstance(local_voice(VoiceSection()), Silence)


class Program:
    """Popen's fake body: a program that says line after line until it is ended."""

    def __init__(self, command: list[str], **options: object) -> None:
        self.command, self.stdin, self.ended = command, io.StringIO(), False

    def poll(self) -> int | None:
        return 1 if self.ended else None

    def kill(self) -> None:
        self.ended = True

    def wait(self) -> None:
        assert self.ended


def test_espeak_is_given_the_words_as_lines_one_program_says_them_and_hush_ends_it(monkeypatch):
    begun: list[Program] = []
    monkeypatch.setattr(
        subprocess, "Popen", lambda *given, **options: begun.append(Program(*given, **options)) or begun[-1]
    )
    voice = EspeakVoice("en")
    voice.say("--version")
    voice.say("I walk to the sofa.")
    [program] = begun
    assert program.command == ["espeak-ng", "-v", "en"] and not program.ended
    assert program.stdin.getvalue() == "--version\nI walk to the sofa.\n"
    voice.hush()
    voice.hush()
    voice.say("Stop: ada said stop.")
    assert [each.ended for each in begun] == [True, False]


def test_an_espeak_that_was_taken_away_ends_no_mission(monkeypatch):
    def gone(*given: object, **options: object) -> None:
        raise FileNotFoundError("espeak-ng")

    monkeypatch.setattr(subprocess, "Popen", gone)
    EspeakVoice("en").say("I walk to the sofa.")
