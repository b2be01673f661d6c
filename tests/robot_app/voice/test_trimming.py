"""Silence goes, speech stays: also where it is all speech, all silence, or a click."""

from __future__ import annotations

import numpy as np
import pytest

from robot_app.voice.audio import RATE_HZ
from robot_app.voice.trimming import MARGIN_S, trimmed

from .conftest import clip, silence, tone


def test_silence_before_and_after_goes_but_a_margin():
    made = trimmed(clip(silence(1.0), tone(0.5), silence(2.0)))
    assert made.seconds == pytest.approx(0.5 + 2 * MARGIN_S, abs=0.05)


def test_a_pause_between_two_words_stays():
    made = trimmed(clip(silence(1.0), tone(0.3), silence(0.8), tone(0.3), silence(1.0)))
    assert made.seconds == pytest.approx(1.4 + 2 * MARGIN_S, abs=0.05)


def test_speech_from_the_first_to_the_last_moment_stays_whole():
    whole = clip(tone(0.7))
    assert trimmed(whole).seconds == whole.seconds


@pytest.mark.parametrize("loudness", [0.02, 0.3, 0.9])
def test_how_loud_somebody_speaks_does_not_matter(loudness):
    made = trimmed(clip(silence(1.0), tone(0.5, loudness), silence(1.0)))
    assert made.seconds == pytest.approx(0.5 + 2 * MARGIN_S, abs=0.05)


@pytest.mark.parametrize("hiss", [1e-3, 1e-2])
def test_a_hissing_microphone_is_silence_too(hiss):
    made = trimmed(clip(silence(1.0, hiss), tone(0.5) + silence(0.5, hiss), silence(1.0, hiss)))
    assert made.seconds == pytest.approx(0.5 + 2 * MARGIN_S, abs=0.1)


def test_nobody_spoke():
    assert trimmed(clip(silence(2.0))) is None
    assert trimmed(clip(np.zeros(RATE_HZ, np.float32))) is None
    assert trimmed(clip(tone(0.01))) is None


def test_a_click_is_nobody_speaking():
    assert trimmed(clip(silence(1.0), tone(0.02), silence(1.0))) is None


def test_a_microphone_with_an_offset_is_not_loud():
    assert trimmed(clip(silence(2.0) + np.float32(0.4))) is None
