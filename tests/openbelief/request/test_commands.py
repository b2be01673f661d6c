"""Sentences that are commands start no drive; sentences that only hold such words are none."""

from __future__ import annotations

import pytest

from openbelief.request import Command, command

COMMANDS = {
    Command.STOP: (
        *("stop", "STOP!", "stop it", "please stop now", "Robot, stop!", "halt", "freeze", "wait", "hold on", "pause"),
        *("could you please stop", "stop stop stop", "emergency stop", "don't move", "stand still", "stop right now"),
    ),
    Command.CANCEL: ("cancel", "cancel that", "abort the mission", "never mind", "nevermind", "forget it, thanks"),
    Command.GO_HOME: ("go home", "please go back to your base", "return to the dock", "drive home", "recharge"),
    Command.COME_BACK: ("come back", "come here", "please come back to me", "return", "follow me"),
    Command.WHERE: ("where are you?", "where are you now", "what's your position?", "status"),
    Command.HELP: ("help", "help me!", "what can you do?", "?", "how does this work"),
    Command.REPEAT: ("repeat", "repeat that please", "again", "say that again", "what did you say?"),
}
THINGS = (
    *("stop sign", "the stop button", "help desk", "where is the lamp", "find the home trainer", "bus stop", "", "  "),
    *(
        "go back to the kitchen",
        "come to the sofa",
        "help me find the lamp",
        "the waiting room",
        "lamp",
        "a stop watch",
    ),
)


@pytest.mark.parametrize(("name", "sentence"), [(name, s) for name, all_ in COMMANDS.items() for s in all_])
def test_a_command_is_known_whatever_politeness_is_around_it(name, sentence):
    assert command(sentence) is name


@pytest.mark.parametrize("sentence", THINGS)
def test_a_sentence_that_names_a_thing_is_no_command(sentence):
    assert command(sentence) is None


def test_a_very_long_text_is_no_command():
    assert command("stop " * 10_000) is None
