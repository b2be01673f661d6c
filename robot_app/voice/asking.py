"""Asking by a recording: what was heard is shown, may be corrected, and goes the way of a typed sentence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from logs.trial.journal import Entry
from openbelief.memory import ObjectMemory
from robot_app.cli import Failure
from robot_app.config_sections import VoiceSection
from robot_app.voice.audio import AudioClip, AudioError, read_wav
from robot_app.voice.listener import Listener, Utterance
from robot_app.voice.note import spoken_note
from robot_app.voice.recogniser import Recogniser
from robot_app.voice.recognisers import open_recogniser
from robot_app.voice.suggestions import memory_phrases

HOW = "voice"
CORRECT = "Press Enter to ask that, or type what you meant."
A_STOP = "the recording says {word!r}: that is a stop, and nothing was asked"
A_TYPED_STOP = "{word!r} was typed: that is a stop, and nothing was asked"


@dataclass(frozen=True)
class SpokenFile:
    """A readable file, and who understands it; opened before the robot is, for either may be missing."""

    clip: AudioClip
    recogniser: Recogniser

    @classmethod
    def open(cls, path: Path, voice: VoiceSection) -> SpokenFile:
        """Raises Failure with the remedy."""
        try:
            clip = read_wav(path)
        except AudioError as error:
            raise Failure(str(error)) from error
        return cls(clip, open_recogniser(voice.recogniser, voice.language))

    def understood(self, memory: ObjectMemory | None = None) -> Utterance:
        """memory: whose words are likely. Raises Failure where nothing was said."""
        try:
            return Listener(self.recogniser, memory_phrases(memory) if memory else ()).understand(self.clip)
        except AudioError as error:
            raise Failure(str(error)) from error


def notes_of(utterance: Utterance | None, asked: str) -> tuple[Entry, ...]:
    return () if utterance is None else (spoken_note(utterance, asked),)


def show(utterance: Utterance, tell: Callable[[str], None]) -> None:
    """What was heard, and what else may have been meant. Raises Failure where it is a stop: that asks for nothing."""
    tell(f"Heard {utterance.told}.")
    for each in utterance.suggestions:
        tell(f"  Did you mean: {each.sentence}")
    if utterance.stop:
        raise Failure(A_STOP.format(word=utterance.stop.word))


def utterance_json(utterance: Utterance) -> dict[str, Any]:
    return {
        "transcript": utterance.transcript,
        "confidence": utterance.confidence,
        "recogniser": utterance.recogniser,
        "language": utterance.language,
        "seconds": round(utterance.seconds, 3),
        "stop": utterance.stop.word if utterance.stop else None,
        "suggestions": [{"sentence": each.sentence, "ratio": each.ratio} for each in utterance.suggestions],
    }
