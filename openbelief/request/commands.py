"""Sentences that tell the robot what to do with itself, and name nothing to drive to.

The parser owns them, so that every face of the operator hears the same words: `command("stop!")`. A sentence is a
command only as a whole: "stop" is one, "the stop sign" is not.
"""

from __future__ import annotations

import re
from enum import StrEnum

from openbelief.request.sentence import LETTERS_MAX, plain, polished


class Command(StrEnum):
    """What is wanted. STOP comes first in every respect: whoever hears a command acts on it before anything else."""

    STOP = "stop"
    CANCEL = "cancel"
    GO_HOME = "go home"
    COME_BACK = "come back"
    WHERE = "where are you"
    HELP = "help"
    REPEAT = "repeat"


# The sentences of each command, without politeness, without the robot's name and without a full stop.
_SENTENCES: dict[Command, tuple[str, ...]] = {
    Command.STOP: (
        r"(?:emergency )?stop(?: (?:it|that|now|moving|walking|driving|there|here|the robot|everything))?",
        r"stop (?:immediately|at once|right there|right here|right now|where you are)|stop(?: stop)+|stopp|e-?stop",
        r"halt(?: now)?|freeze|whoa|wait|hold on|hold it|hold|pause|stand still|cease|hands off|s",
        r"stay(?: there| here| where you are| put)?|do not move|don't move",
    ),
    Command.CANCEL: (
        r"cancel(?: (?:it|that|this|the mission|the drive|the goal|everything|all))?",
        r"abort(?: (?:it|that|the mission))?|never ?mind|forget (?:it|that|about it)|leave it|give up|quit the mission",
    ),
    Command.GO_HOME: (
        r"(?:go|drive|walk|return)(?: back)? (?:home|to (?:the |your )?(?:base|dock|home|charger|charging station))",
        r"(?:go|drive|walk|return)(?: back)? to (?:the |your )?(?:docking station|start|start position)",
        r"(?:take|bring|get) (?:me|us) (?:back )?home|home|go charge|(?:go )?recharge",
    ),
    Command.COME_BACK: (
        r"come back(?: (?:here|to me|to us|now))?|come(?: here| to me| over here| over)?|return(?: to me| here)?",
        r"go back|get back(?: here)?|follow me|come along",
    ),
    Command.WHERE: (
        r"where are you(?: now| going| at)?|where is the robot|where do you stand|where did you go",
        r"what(?: is|'s) your (?:position|location|place)|what are you doing|how far are you|status",
    ),
    Command.HELP: (
        r"help(?: me)?|what can (?:you do|i say|i ask|i do)|how does (?:this|it) work|what do you know|commands|usage",
        r"what are the commands|show (?:me )?(?:the )?(?:help|commands)",
    ),
    Command.REPEAT: (
        r"repeat(?: (?:it|that|this|please|the last one|yourself))?|again|once more|one more time|pardon|same again",
        r"say (?:that|it) again|what did you say|(?:do|try) (?:it|that) again|try again|retry",
    ),
}
_PATTERNS = tuple((name, re.compile(f"(?:{'|'.join(ways)})")) for name, ways in _SENTENCES.items())


def command(sentence: str) -> Command | None:
    """The command that a whole sentence is, politeness and the robot's name aside; None where it is none."""
    if len(sentence) > LETTERS_MAX:
        return None
    if sentence.strip() and not sentence.strip(" ?"):
        return Command.HELP
    said = tuple(words.replace("where's", "where is") for words in (plain(sentence), polished(sentence)))
    return next((name for words in said for name, pattern in _PATTERNS if words and pattern.fullmatch(words)), None)
