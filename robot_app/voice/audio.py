"""Audio as mono 16 kHz float32, and the one reader of WAV files."""

from __future__ import annotations

import io
import wave
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from openbelief.arrays import Array

RATE_HZ = 16_000
MAX_S = 30.0  # what one press of a talk button may hold; a recogniser's memory grows with it
MAX_BYTES = 16 << 20
RATES_HZ = (8_000, 192_000)
CONVERT = "convert it with: sox IN -r 16000 -c 1 -b 16 OUT.wav"
FULL_SCALE = {1: 128.0, 2: 32768.0, 3: 8388608.0, 4: 2147483648.0}  # bytes a sample -> its largest value


class AudioError(ValueError):
    """Sound that is refused; the text is one line with the cause and the remedy."""


@dataclass(frozen=True, eq=False)
class AudioClip:
    """samples: (n,) float32 in [-1, 1], mono, RATE_HZ."""

    samples: Array

    @property
    def seconds(self) -> float:
        return len(self.samples) / RATE_HZ

    def pcm16(self) -> bytes:
        """Little-endian signed 16 bit, the way speech travels and is kept."""
        return bytes((np.clip(self.samples, -1.0, 1.0) * 32767.0).round().astype("<i2").tobytes())

    def wav(self) -> bytes:
        data = io.BytesIO()
        with wave.open(data, "wb") as file:
            file.setnchannels(1)
            file.setsampwidth(2)
            file.setframerate(RATE_HZ)
            file.writeframes(self.pcm16())
        return data.getvalue()


def clip_of_pcm16(data: bytes, rate_hz: int = RATE_HZ) -> AudioClip:
    """Mono little-endian 16 bit. Raises AudioError: nothing, half a sample, over MAX_S, or no usable rate."""
    if len(data) % 2:
        raise AudioError("The sound ends in the middle of a sample: say it again.")
    return _clip(np.frombuffer(data, "<i2").astype(np.float32) / 32768.0, rate_hz)


def clip_of_wav(data: bytes, name: str = "The sound") -> AudioClip:
    """Raises AudioError where it is no PCM WAV file, or one that `clip_of_pcm16` would not take."""
    if len(data) > MAX_BYTES:
        raise AudioError(f"{name} has {len(data) >> 20} MiB; {MAX_BYTES >> 20} MiB is the limit for one sentence.")
    try:
        with wave.open(io.BytesIO(data)) as file:
            width, channels, rate_hz = file.getsampwidth(), file.getnchannels(), file.getframerate()
            frames = file.readframes(file.getnframes())
    except (wave.Error, EOFError, RuntimeError) as error:  # the last where a part claims more than there is
        raise AudioError(f"{name} is no PCM WAV file ({str(error) or 'it ends early'}): {CONVERT}") from error
    if width not in FULL_SCALE or not 1 <= channels <= 8:
        raise AudioError(f"{name} has {channels} channels of {8 * width} bit: {CONVERT}")
    whole = len(frames) - len(frames) % (width * channels)  # a recorder that was killed leaves part of a frame
    return _clip(_samples(frames[:whole], width).reshape(-1, channels).mean(axis=1), rate_hz, name)


def read_wav(path: Path) -> AudioClip:
    """Raises AudioError, also where the file cannot be read."""
    try:
        with path.open("rb") as file:
            return clip_of_wav(file.read(MAX_BYTES + 1), str(path))
    except OSError as error:
        raise AudioError(f"{path} cannot be read: {error.strerror}") from error


def _samples(frames: bytes, width: int) -> Array:
    """(n,) float32 of little-endian PCM; 8 bit is unsigned, as WAV has it."""
    if width == 1:
        values = np.frombuffer(frames, np.uint8).astype(np.float32) - 128.0
    elif width == 3:
        low = np.frombuffer(frames, np.uint8).reshape(-1, 3)
        padded = np.concatenate([np.zeros((len(low), 1), np.uint8), low], axis=1)
        values = (np.ascontiguousarray(padded).view("<i4").ravel() >> 8).astype(np.float32)
    else:
        values = np.frombuffer(frames, f"<i{width}").astype(np.float32)
    return values / np.float32(FULL_SCALE[width])


def _clip(samples: Array, rate_hz: int, name: str = "The sound") -> AudioClip:
    if not RATES_HZ[0] <= rate_hz <= RATES_HZ[1]:
        raise AudioError(f"{name} is sampled at {rate_hz} Hz; {RATES_HZ[0]} to {RATES_HZ[1]} Hz can be used.")
    if not len(samples):
        raise AudioError(f"{name} is empty.")
    if len(samples) > MAX_S * rate_hz:
        raise AudioError(f"{name} lasts {len(samples) / rate_hz:.0f} s; {MAX_S:.0f} s is the limit for one sentence.")
    return AudioClip(_resampled(samples, rate_hz))


def _resampled(samples: Array, rate_hz: int) -> Array:
    """(n,) float32 at RATE_HZ."""
    if rate_hz == RATE_HZ:
        return samples.astype(np.float32)
    from scipy.signal import resample_poly

    ratio = Fraction(RATE_HZ, rate_hz)
    return np.asarray(resample_poly(samples, ratio.numerator, ratio.denominator), dtype=np.float32)
