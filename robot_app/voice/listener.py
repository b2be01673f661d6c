"""From sound to an utterance: trimmed, recognised, looked at for a stop and for phrases of the memory."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from robot_app.voice.audio import AudioClip, AudioError
from robot_app.voice.recogniser import Recogniser
from robot_app.voice.spoken_stop import SpokenStop, spoken_stop
from robot_app.voice.suggestions import Suggestion, suggestions
from robot_app.voice.trimming import trimmed

NOTHING_SAID = "nothing was said: hold the button while you speak, and check the microphone"
NO_WORDS = "no words were made out: say it again, closer to the microphone, or type it"


class NothingHeard(AudioError):
    """Silence, or sound without words."""


@dataclass(frozen=True)
class Utterance:
    """What was said, as it was understood. clip: the whole recording, as it came. seconds: that recognising took."""

    clip: AudioClip
    transcript: str
    confidence: float | None
    recogniser: str
    language: str
    seconds: float
    stop: SpokenStop | None
    suggestions: tuple[Suggestion, ...]

    @property
    def told(self) -> str:
        """For the screen: `"take me to the sofa" (confidence 0.83)`."""
        sure = "unknown" if self.confidence is None else f"{self.confidence:.2f}"
        return f'"{self.transcript}" (confidence {sure})'


class Listener:
    """Understands clips with one recogniser, over one memory's phrases. Safe to use from several threads."""

    def __init__(
        self,
        recogniser: Recogniser,
        phrases: Sequence[str] = (),
        monotonic_s: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.recogniser, self._phrases, self._monotonic_s = recogniser, tuple(phrases), monotonic_s

    def understand(self, clip: AudioClip) -> Utterance:
        """Raises NothingHeard where nobody spoke or no word was made out."""
        part = trimmed(clip)
        if part is None:
            raise NothingHeard(NOTHING_SAID)
        start_s = self._monotonic_s()
        heard = self.recogniser.hear(part.samples)
        took_s = self._monotonic_s() - start_s
        stop = spoken_stop(heard.text) or spoken_stop(heard.again)
        if not stop and not any(letter.isalnum() for letter in heard.text):
            raise NothingHeard(NO_WORDS)
        return Utterance(
            clip=clip,
            transcript=heard.text,
            confidence=heard.confidence,
            recogniser=self.recogniser.id,
            language=self.recogniser.language,
            seconds=took_s,
            stop=stop,
            suggestions=() if stop else tuple(suggestions(heard.text, self._phrases, heard.again)),
        )
