"""A spoken stop: what counts as one. It is a software stop like the typed one, and no emergency stop.

A wrong stop costs a question asked again, a missed one costs more: so an utterance of one or two different words counts
where one of them is "stop", or a word that recognisers make of a spoken "stop" (openbelief bench voice counts both).
Longer ones count as typed ones do: "stop right now" is a command, "the stop sign in the hall" is a thing.
"""

from __future__ import annotations

from dataclasses import dataclass

from openbelief.request import Command, command
from robot_app.voice.words import words_of

WORDS = frozenset({"stop", "halt"})
# From synthetic voices and noise that the bench does not judge with, and from earlier measurements.
NEAR_MISSES = frozenset(
    {
        "stops",
        "stopped",
        "stopping",
        "top",
        "tops",
        "atop",
        "step",
        "stock",
        "stomp",
        "stoop",
        "strop",
        "slop",
        "slap",
        "sop",
        "stob",
        "stope",
        "stopp",
    }
)
# With one of these beside it a near miss still counts; "step ladder" and "stock pot" are things to find.
BESIDE = frozenset(
    {
        "a",
        "and",
        "hey",
        "it",
        "it's",
        "its",
        "i",
        "i'm",
        "now",
        "oh",
        "ok",
        "okay",
        "please",
        "robot",
        "so",
        "the",
        "that",
        "there",
        "you",
    }
)


@dataclass(frozen=True, slots=True)
class SpokenStop:
    """word: what was heard. near_miss: it is not "stop" itself, but taken for it."""

    word: str
    near_miss: bool

    @property
    def because(self) -> str:
        """The reason of the STOP, for log, screen and trial."""
        return f"heard {self.word!r}, which counts as stop" if self.near_miss else f"the operator said {self.word}"


def spoken_stop(transcript: str) -> SpokenStop | None:
    """The stop in an utterance, None where there is none. "Stop! Stop! Stop!" is one word."""
    if command(transcript) is Command.STOP:
        return SpokenStop(" ".join(words_of(transcript)), near_miss=False)
    words = list(dict.fromkeys(words_of(transcript)))
    if not 1 <= len(words) <= 2:
        return None
    if said := next((word for word in words if word in WORDS), None):
        return SpokenStop(said, near_miss=False)
    near = next((word for word in words if word in NEAR_MISSES), None)
    if near and all(word in NEAR_MISSES | BESIDE for word in words):
        return SpokenStop(near, near_miss=True)
    return None
