"""Moonshine's tiny English model, which lies inside the wheel `moonshine-voice==0.0.73`: no download, no network."""

from __future__ import annotations

import threading
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from openbelief.arrays import Array
from robot_app.cli import Failure
from robot_app.voice.audio import RATE_HZ
from robot_app.voice.recogniser import HOW_TO_ADD, Heard
from robot_app.voice.words import words_in_common

LANGUAGE = "en"
# Its own voice detection invents words at the edges ("You", "I"): 9.9 % of words wrong with it, 5.0 % without.
OPTIONS = {"vad_threshold": "0", "identify_speakers": "false", "return_audio_data": "false"}
FASTER = 1.05


class MoonshineRecogniser:
    """The model tells no probabilities: confidence is how many words a second hearing, 5 % faster, agrees on."""

    def __init__(self, transcriber: Any, name: str) -> None:
        self.id, self.language = name, LANGUAGE
        self._transcriber, self._one_at_a_time = transcriber, threading.Lock()

    @classmethod
    def open(cls, language: str) -> MoonshineRecogniser:
        """Raises Failure where the extra is not installed, or another language is asked for."""
        if language != LANGUAGE:
            raise Failure(
                f"moonshine's model inside the wheel knows English alone, not {language!r}: name a model of that "
                'language with recogniser = "sherpa:KIND:FOLDER", or say language = "en"'
            )
        try:
            import moonshine_voice
            from moonshine_voice.errors import MoonshineError
            from moonshine_voice.transcriber import ModelArch, Transcriber
        except ImportError as error:
            raise Failure(HOW_TO_ADD) from error
        folder = Path(moonshine_voice.__file__).parent / "assets" / "tiny-en"
        if not folder.is_dir():
            raise Failure(f"this moonshine-voice carries no model ({folder}): {HOW_TO_ADD}")
        try:
            transcriber = Transcriber(folder, ModelArch.TINY, options=OPTIONS)
        except MoonshineError as error:
            raise Failure(f"moonshine's model cannot be loaded: {error}") from error
        return cls(transcriber, f"moonshine-voice {version('moonshine-voice')} tiny-en")

    def hear(self, samples: Array) -> Heard:
        """Raises Failure where the model breaks on it."""
        from moonshine_voice.errors import MoonshineError

        try:
            with self._one_at_a_time:
                first, again = self._text(samples), self._text(_faster(samples))
        except MoonshineError as error:
            raise Failure(f"the recogniser failed ({error}): say it again, or type it") from error
        return Heard(first, words_in_common(first, again) if first else None, again)

    def _text(self, samples: Array) -> str:
        transcript = self._transcriber.transcribe_without_streaming(samples.tolist(), RATE_HZ)
        return " ".join(line.text.strip() for line in transcript.lines).strip()


def _faster(samples: Array) -> Array:
    """(n / FASTER,) the same sound, faster and a little higher."""
    at = np.arange(0.0, len(samples) - 1, FASTER)
    return np.interp(at, np.arange(len(samples)), samples).astype(np.float32)
