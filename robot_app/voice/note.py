"""An utterance as its trial keeps it: words, confidence, and the sound itself. A replay needs no recogniser."""

from __future__ import annotations

import hashlib

from logs.trial.journal import Entry, Sound
from logs.trial.records import Spoken
from robot_app.voice.listener import Utterance


def spoken_note(utterance: Utterance, asked: str) -> Entry:
    """asked: what went on from it, after the operator's correction; "" where it was only heard."""
    wav = utterance.clip.wav()
    record = Spoken(
        transcript=utterance.transcript,
        asked=asked,
        confidence=utterance.confidence,
        recogniser=utterance.recogniser,
        language=utterance.language,
        suggestions=tuple(each.phrase for each in utterance.suggestions),
        took_s=round(utterance.seconds, 3),
        audio_s=round(utterance.clip.seconds, 3),
        audio=f"spoken_{hashlib.sha256(wav).hexdigest()[:16]}.wav",
    )
    return Entry(record, Sound(wav))
