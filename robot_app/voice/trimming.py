"""Silence before and after what was said, by loudness alone: recognisers make words of it ("You", "I")."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array
from robot_app.voice.audio import RATE_HZ, AudioClip

FRAME_S, HOP_S = 0.02, 0.01
QUIETEST_DB = -55.0  # of full scale: below it a microphone is off, or nobody spoke
ABOVE_FLOOR_DB, BELOW_PEAK_DB = 6.0, 35.0
SPOKEN_S = 0.06  # shorter than any syllable: a click
MARGIN_S = 0.25  # soft beginnings and ends ("s", "f") that loudness misses


def trimmed(clip: AudioClip) -> AudioClip | None:
    """The part in which somebody speaks, with MARGIN_S around it; None where nobody does.

    A frame is speech where it is louder than the quietest tenth of the clip by ABOVE_FLOOR_DB and at most BELOW_PEAK_DB
    under its loudest moment; runs shorter than SPOKEN_S are clicks.
    """
    loudness = loudness_db(clip.samples)
    if not len(loudness):
        return None
    peak = float(np.percentile(loudness, 99))
    floor = float(np.percentile(loudness, 10))
    threshold = min(max(floor + ABOVE_FLOOR_DB, peak - BELOW_PEAK_DB, QUIETEST_DB), max(peak - 10.0, QUIETEST_DB))
    spoken = _runs(loudness > threshold, shortest=round(SPOKEN_S / HOP_S))
    if not spoken:
        return None
    margin, hop = round(MARGIN_S * RATE_HZ), round(HOP_S * RATE_HZ)
    start = max(0, spoken[0][0] * hop - margin)
    end = min(len(clip.samples), spoken[-1][1] * hop + round(FRAME_S * RATE_HZ) + margin)
    return AudioClip(clip.samples[start:end])


def loudness_db(samples: Array) -> Array:
    """(frames,) RMS in dB of full scale, every HOP_S, of the sound without its offset."""
    frame, hop = round(FRAME_S * RATE_HZ), round(HOP_S * RATE_HZ)
    if len(samples) < frame:
        return np.empty(0)
    frames = np.lib.stride_tricks.sliding_window_view(samples - samples.mean(), frame)[::hop]
    return np.asarray(10.0 * np.log10(np.mean(np.square(frames, dtype=np.float64), axis=1) + 1e-12))


def _runs(loud: Array, shortest: int) -> list[tuple[int, int]]:
    """(first, last + 1) of every run of at least `shortest` true frames."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], loud, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= shortest]
