"""Speaking back through a port: espeak-ng at this machine, the console (robot_app.console.speech), or silence."""

from __future__ import annotations

import contextlib
import subprocess
import threading
from typing import Protocol

from robot_app.config_sections import VoiceSection
from robot_app.mission.notices import Change, Notice
from robot_app.mission.operator import SharedOperator
from robot_app.voice.moments import said_aloud
from robot_app.voice.synthetic import installed


class Voice(Protocol):
    """Neither waits nor raises."""

    def say(self, words: str) -> None:
        """Say it after what is being said."""
        ...

    def hush(self) -> None:
        """Say no more of it, nor of what waits."""
        ...


class Silence:
    def say(self, words: str) -> None: ...

    def hush(self) -> None: ...


class EspeakVoice:
    """This machine's loudspeaker: espeak-ng as a program of its own, which says one line after the other."""

    def __init__(self, language: str) -> None:
        self._command = ["espeak-ng", "-v", language]
        self._speaking: subprocess.Popen[str] | None = None

    def say(self, words: str) -> None:
        with contextlib.suppress(OSError):  # taken away meanwhile: the words are on the screen
            speaking = self._program()
            assert speaking.stdin is not None
            speaking.stdin.write(f"{words}\n")
            speaking.stdin.flush()

    def hush(self) -> None:
        speaking, self._speaking = self._speaking, None
        if speaking is not None:
            speaking.kill()
            speaking.wait()

    def _program(self) -> subprocess.Popen[str]:
        if self._speaking is None or self._speaking.poll() is not None:
            self._speaking = subprocess.Popen(
                self._command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, text=True
            )
        return self._speaking


def local_voice(voice: VoiceSection) -> Voice:
    return EspeakVoice(voice.language) if voice.speak == "auto" and installed("espeak-ng") else Silence()


class Speaker:
    """A listener of the operator that says what matters: a STOP at once, other sentences one after the other."""

    def __init__(self, operator: SharedOperator, voice: Voice) -> None:
        self._operator, self._voice = operator, voice
        self._listening, self._lock = 0, threading.Lock()

    def __enter__(self) -> Speaker:
        self._end_listening = self._operator.listen(self._hear)
        return self

    def __exit__(self, *_: object) -> None:
        self._end_listening()
        with self._lock:
            self._voice.hush()

    def quiet(self, yes: bool) -> None:
        """Somebody begins to be listened to, or no longer is: what is said meanwhile is not said later either."""
        with self._lock:
            self._listening += 1 if yes else -1
            if yes:
                self._voice.hush()

    def _hear(self, notice: Notice) -> None:
        if words := said_aloud(notice):
            with self._lock:
                if self._listening:
                    return
                if notice.change is Change.STOPPED:
                    self._voice.hush()
                self._voice.say(words)
