"""What an operator's commands do: a stop in any words stops, and what is not supported says so."""

from __future__ import annotations

from openbelief.request import Command, command

STOPS = (Command.STOP, Command.CANCEL)
REPLIES = {
    Command.STOP: "That is a stop, not a thing to look for.",
    Command.CANCEL: "That is a stop, not a thing to look for.",
    Command.GO_HOME: "Going home is not supported, nothing moves: ask for a thing that stands there.",
    Command.COME_BACK: "Coming back is not supported, nothing moves: ask for a thing that stands beside you.",
    Command.WHERE: "Where the robot is, the page's plan shows (--console): here ask for a thing to drive to.",
    Command.HELP: (
        'Say what to find, like "take me to the fire extinguisher". stop works at any time; when you are asked: yes, '
        "no, why, or a candidate by its number (take 2). An empty line ends."
    ),
    Command.REPEAT: "Nothing is done again by itself: say the sentence once more.",
}


def is_stop(line: str) -> bool:
    """A stop or a cancel in any of the words that the parser knows."""
    return command(line) in STOPS


def reply_to(line: str) -> str | None:
    """What is said to a sentence that is a command; None where it may name a thing."""
    told = command(line)
    return None if told is None else REPLIES[told]
