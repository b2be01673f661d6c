"""The recogniser port: sound in, words out, offline; and the table of its bodies.

`[voice] recogniser` names one: "moonshine" (the English model inside the wheel of the extra `voice`), or
"sherpa:KIND:FOLDER" (a model that the user brings, in its own language; robot_app.voice.sherpa lists the kinds).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from openbelief.arrays import Array
from robot_app.cli import Failure

HOW_TO_ADD = (
    "recognising speech needs the extra `voice`: add it in the checkout with "
    ".venv/bin/python -m pip install -r requirements/voice.txt"
)
FORMS = "moonshine or sherpa:KIND:FOLDER"


@dataclass(frozen=True)
class Heard:
    """text: as the recogniser spells it, "" where it made nothing of the sound. confidence: 0 to 1, None: unknown.

    again: what a second hearing made of the same sound, "" where there was none; a stop counts in either.
    """

    text: str
    confidence: float | None
    again: str = ""


class Recogniser(Protocol):
    """Safe to call from several threads, one at a time."""

    id: str
    language: str

    def hear(self, samples: Array) -> Heard:
        """samples: (n,) float32 in [-1, 1], mono, 16 kHz, without long silence."""
        ...


def open_recogniser(spec: str, language: str = "en") -> Recogniser:
    """Raises Failure, one line with the remedy: unknown, not installed, no such model, or not of that language."""
    kind, _, argument = spec.partition(":")
    if kind not in RECOGNISERS:
        raise Failure(f"there is no recogniser {spec!r}: name {FORMS}")
    return RECOGNISERS[kind](argument, language)


def _moonshine(argument: str, language: str) -> Recogniser:
    from robot_app.voice.moonshine import MoonshineRecogniser

    if argument:
        raise Failure(f"moonshine takes no argument, got {argument!r}: other models are named by {FORMS}")
    return MoonshineRecogniser.open(language)


def _sherpa(argument: str, language: str) -> Recogniser:
    from robot_app.voice.sherpa import SherpaRecogniser

    return SherpaRecogniser.open(argument, language)


RECOGNISERS: dict[str, Callable[[str, str], Recogniser]] = {"moonshine": _moonshine, "sherpa": _sherpa}
