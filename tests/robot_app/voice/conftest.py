"""Speech to listen to, and a recogniser that hears what a test says it hears."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from robot_app.voice.audio import RATE_HZ, AudioClip
from robot_app.voice.recogniser import Heard

SPEECH = Path(__file__).parent / "speech"


class ScriptedRecogniser:
    """A recogniser's fake body: every clip has the same words. heard: the samples that it was given."""

    id, language = "scripted", "en"

    def __init__(self, text: str, confidence: float | None = None, again: str = "") -> None:
        self.text, self.confidence, self.again = text, confidence, again
        self.heard: list[np.ndarray] = []

    def hear(self, samples: np.ndarray) -> Heard:
        self.heard.append(samples)
        return Heard(self.text, self.confidence, self.again)


def tone(seconds: float, amplitude: float = 0.3, hz: float = 300.0) -> np.ndarray:
    return (amplitude * np.sin(2 * np.pi * hz * np.arange(round(seconds * RATE_HZ)) / RATE_HZ)).astype(np.float32)


def silence(seconds: float, amplitude: float = 1e-4) -> np.ndarray:
    noise = np.random.default_rng(3).normal(0.0, amplitude, round(seconds * RATE_HZ))
    return noise.astype(np.float32)


def clip(*parts: np.ndarray) -> AudioClip:
    return AudioClip(np.concatenate(parts))


@pytest.fixture
def speech() -> Path:
    return SPEECH
