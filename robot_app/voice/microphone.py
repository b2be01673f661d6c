"""This machine's microphone, through PortAudio (extra `voice`)."""

from __future__ import annotations

from typing import Any

from robot_app.cli import Failure
from robot_app.voice.audio import MAX_S, RATE_HZ
from robot_app.voice.recogniser import HOW_TO_ADD

PORTAUDIO_ADD = "the microphone needs PortAudio: sudo apt-get install libportaudio2"
WHICH = "[voice] microphone in robot.toml takes part of a name that .venv/bin/python -m sounddevice lists"
BYTES_MAX = round(MAX_S * RATE_HZ) * 2


class LocalMicrophone:
    """Mono 16 kHz s16le from `start` to `stop`; name: part of the device's name, "" for the usual one."""

    def __init__(self, name: str) -> None:
        """Raises Failure: the extra or PortAudio is missing."""
        try:
            import sounddevice
        except ImportError as error:
            raise Failure(HOW_TO_ADD) from error
        except OSError as error:
            raise Failure(PORTAUDIO_ADD) from error
        self._api, self._name = sounddevice, name or None
        self._stream: Any = None
        self._sound = bytearray()

    def start(self) -> None:
        """Raises Failure where no such microphone can be opened."""
        self._sound = bytearray()
        try:
            self._stream = self._api.RawInputStream(
                samplerate=RATE_HZ, channels=1, dtype="int16", device=self._name, callback=self._take
            )
            self._stream.start()
        except (self._api.PortAudioError, ValueError) as error:
            self._stream = None
            raise Failure(f"the microphone cannot be opened: {_one_line(error)}; {WHICH}") from error

    def stop(self) -> bytes:
        """What came since. Raises Failure where the device was lost meanwhile."""
        stream, self._stream = self._stream, None
        if stream is not None:
            try:
                stream.stop()
                stream.close()
            except self._api.PortAudioError as error:
                raise Failure(f"the microphone was lost: {error}; plug it in and press Enter again") from error
        return bytes(self._sound)

    def _take(self, block: Any, *_: Any) -> None:
        if len(self._sound) <= BYTES_MAX:
            self._sound += bytes(block)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
