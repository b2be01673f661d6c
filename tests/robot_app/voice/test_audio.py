"""Sound comes in by one door: what is usable is mono 16 kHz afterwards, and what is not is refused in one line."""

from __future__ import annotations

import io
import wave

import numpy as np
import pytest

from robot_app.voice.audio import MAX_S, RATE_HZ, AudioClip, AudioError, clip_of_pcm16, clip_of_wav, read_wav

from .conftest import tone

HALF = {1: lambda x: (x * 127 + 128).astype(np.uint8).tobytes(), 2: lambda x: (x * 32767).astype("<i2").tobytes()}


def wav(samples: np.ndarray, *, rate_hz: int = RATE_HZ, width: int = 2, channels: int = 1) -> bytes:
    data = io.BytesIO()
    with wave.open(data, "wb") as file:
        file.setnchannels(channels)
        file.setsampwidth(width)
        file.setframerate(rate_hz)
        if width == 3:
            values = (samples * 8388607).astype("<i4").reshape(-1, 1).view(np.uint8).reshape(-1, 4)[:, :3]
            frames = values.tobytes()
        elif width == 4:
            frames = (samples * 2147483000).astype("<i4").tobytes()
        else:
            frames = HALF[width](samples)
        file.writeframes(frames * 1 if channels == 1 else np.repeat(np.frombuffer(frames, "<i2"), channels).tobytes())
    return data.getvalue()


@pytest.mark.parametrize("width", [1, 2, 3, 4])
def test_every_width_of_pcm_gives_the_same_sound(width):
    made = clip_of_wav(wav(tone(0.2), width=width))
    assert made.samples.dtype == np.float32 and np.abs(made.samples - tone(0.2)).max() < 0.011


def test_channels_are_averaged():
    assert np.abs(clip_of_wav(wav(tone(0.2), channels=2)).samples - tone(0.2)).max() < 1e-3


@pytest.mark.parametrize("rate_hz", [8000, 22050, 44100, 48000])
def test_another_rate_is_the_same_tone_of_the_same_length(rate_hz):
    times = np.arange(rate_hz // 2) / rate_hz
    made = clip_of_wav(wav(0.3 * np.sin(2 * np.pi * 300 * times), rate_hz=rate_hz))
    assert made.seconds == pytest.approx(0.5, abs=0.01)
    spectrum = np.abs(np.fft.rfft(made.samples))
    assert np.argmax(spectrum) * RATE_HZ / len(made.samples) == pytest.approx(300, abs=3)


def test_what_is_kept_is_what_was_heard():
    made = AudioClip(tone(0.3))
    assert np.abs(clip_of_wav(made.wav()).samples - made.samples).max() < 1e-4
    assert np.abs(clip_of_pcm16(made.pcm16()).samples - made.samples).max() < 1e-4


@pytest.mark.parametrize(
    ("data", "because"),
    [
        (b"", "no PCM WAV file"),
        (b"RIFF\0\0\0\0WAVEfmt ", "no PCM WAV file"),
        (b"\xff\xfb" * 999, "no PCM WAV file"),
        (wav(np.empty(0)), "is empty"),
        (wav(tone(0.1), rate_hz=4000), "sampled at 4000 Hz"),
        (wav(np.zeros(8000 * 31), rate_hz=8000), "30 s is the limit"),
        (b"x" * ((16 << 20) + 1), "MiB is the limit"),
    ],
)
def test_what_is_no_usable_sound_is_refused_in_one_line(data, because):
    with pytest.raises(AudioError, match=because) as refused:
        clip_of_wav(data)
    assert "\n" not in str(refused.value)


def test_half_a_sample_and_too_much_are_refused_from_the_microphone_too():
    with pytest.raises(AudioError, match="middle of a sample"):
        clip_of_pcm16(b"\0\0\0")
    with pytest.raises(AudioError, match="limit for one sentence"):
        clip_of_pcm16(bytes(2 * (round(MAX_S * RATE_HZ) + 1)))


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(AudioError, match=r"no_such\.wav cannot be read"):
        read_wav(tmp_path / "no_such.wav")


def test_a_recording_cut_off_in_the_middle_of_a_frame_is_used_as_far_as_it_goes():
    whole = wav(tone(0.2), width=2)
    assert clip_of_wav(whole[:-1]).seconds == pytest.approx(0.2, abs=0.001)
