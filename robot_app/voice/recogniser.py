"""The recogniser port: sound in, words out, offline. Its bodies are in the table of robot_app.voice.recognisers.

`[voice] recogniser` names one: "moonshine" (the English model inside the wheel of the extra `voice`), or
"sherpa:KIND:FOLDER" (a model that the user brings, in its own language; robot_app.voice.sherpa lists the kinds).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from openbelief.arrays import Array

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
