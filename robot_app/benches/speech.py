"""Speech to judge listening with: human recordings that Debian packages carry, and synthetic voices."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from openbelief.arrays import Array
from robot_app.voice.audio import RATE_HZ, AudioClip, AudioError, clip_of_pcm16, read_wav
from robot_app.voice.synthetic import installed, spoken

HUMAN = Path("/usr/share/pocketsphinx/test/data")
HUMAN_ADD = "sudo apt-get install pocketsphinx-testdata"
LINE = re.compile(r"<s>\s*(?P<words>.*?)\s*</s>\s*\((?P<name>[^)]+)\)")
# Recordings whose words stand in no transcript file; None: nobody says which words they are.
BARE = {
    "goforward.raw": "go forward ten meters",
    "tidigits/dhd.2934z.raw": "two nine three four zero",
    "something.raw": None,
    "numbers.raw": None,
}
# Sentence -> the thing in it, "" where it names none.
SENTENCES = {
    "take me to the fire extinguisher": "fire extinguisher",
    "find the red chair in the kitchen": "red chair",
    "where is the laundry basket": "laundry basket",
    "go to the second door on the left": "second door",
    "bring me to the coffee machine": "coffee machine",
    "look for something to sit on": "",
    "show me the white mug next to the sink": "white mug",
    "walk to the window": "window",
}
# No voice here was listened to while the rule for stop and the trimming were made.
ESPEAK = ("m2", "m3", "m4", "m5", "m6", "m7", "m8", "f2", "f3", "f4", "f5", "max", "michel", "steph", "edward")
VOICES = (*(("espeak-ng", f"en-us+{name}") for name in ESPEAK), ("flite", "awb"), ("flite", "rms"), ("flite", "slt"))
SENTENCE_VOICES = (*VOICES[::4], *VOICES[-3:])
RATES = (140, 175, 220)  # words a minute
NOISES_DB = (None, 20.0, 10.0)  # of the voice above white noise
PAUSE_S = 0.4


@dataclass(frozen=True)
class Said:
    """A clip, and the words in it, None where nobody knows them. noise: what was laid over it. thing: in the words."""

    name: str
    clip: AudioClip
    words: str | None
    noise: str = ""
    thing: str = ""


def human(folder: Path) -> Iterator[Said]:
    """What pocketsphinx-testdata carries; nothing where it is not installed."""
    for listing in sorted(folder.glob("*/*transcription")):
        for found in LINE.finditer(listing.read_text(encoding="utf-8")):
            yield Said(found["name"], read_wav(listing.parent / f"{found['name']}.wav"), found["words"])
    for name, words in BARE.items():
        if (folder / name).exists():
            yield Said(name, clip_of_pcm16((folder / name).read_bytes()), words)


def others(folder: Path) -> Iterator[Said]:
    """The WAV files under a folder, of people who do not say stop; what is too long for a sentence is left out."""
    for path in sorted(folder.rglob("*.wav")):
        with contextlib.suppress(AudioError):
            yield Said(str(path.relative_to(folder)), read_wav(path), None)


def synthetic_sentences() -> Iterator[Said]:
    """Each sentence by each of SENTENCE_VOICES that is installed."""
    for program, voice in SENTENCE_VOICES:
        if installed(program):
            for words, thing in SENTENCES.items():
                yield Said(f"{voice}: {words}", in_a_pause(spoken(words, program, voice)), words, thing=thing)


def vocabulary() -> list[str]:
    """The phrases of a memory that those sentences are said over: their things among those of the demo's flat."""
    from sim_fakes.world.world import World

    return sorted({*filter(None, SENTENCES.values()), *(each.label for each in World.load("flat").objects)})


def synthetic_stops() -> Iterator[Said]:
    """The word by every installed voice at every rate, at every level of noise."""
    rng = np.random.default_rng(20_261_129)
    for program, voice in VOICES:
        if not installed(program):
            continue
        for rate in RATES:
            clip = in_a_pause(spoken("stop", program, voice, rate))
            for level in NOISES_DB:
                noise = "clean" if level is None else f"{level:.0f} dB above noise"
                yield Said(f"{voice} {rate}", clip if level is None else _noisy(clip, level, rng), "stop", noise)


def in_a_pause(clip: AudioClip) -> AudioClip:
    """As a talk button records it: a moment of silence before and after."""
    silence = np.zeros(round(PAUSE_S * RATE_HZ), np.float32)
    return AudioClip(np.concatenate([silence, clip.samples, silence]))


def _noisy(clip: AudioClip, above_db: float, rng: np.random.Generator) -> AudioClip:
    voice = clip.samples[clip.samples != 0.0]
    rms = float(np.sqrt(np.mean(np.square(voice)))) if len(voice) else 0.0
    noise: Array = rng.normal(0.0, rms / 10 ** (above_db / 20), len(clip.samples)).astype(np.float32)
    return AudioClip(np.clip(clip.samples + noise, -1.0, 1.0))
