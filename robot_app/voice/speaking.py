"""Speaking back: where the robot goes, what it found, why not; by espeak-ng, or silence."""

from __future__ import annotations

import subprocess
import threading

from robot_app.mission.operator import Change, Notice, SharedOperator
from robot_app.voice.synthetic import installed

SPOKEN = (Change.TOLD, Change.ASKED, Change.STOPPED, Change.EXPIRED)
LONGEST = 160  # characters: a listener does not follow more
NOT_SAID = ("trial:", "Heard ", "Listening:")


class Speaker:
    """A listener of the Operator. A newer sentence cuts off the older one; `quiet` while somebody is listened to."""

    def __init__(self, operator: SharedOperator, *, speak: str, language: str = "en") -> None:
        """speak: "auto" where espeak-ng is installed, "off" never."""
        self._operator, self._language = operator, language
        self._able = speak == "auto" and installed("espeak-ng")
        self._voice: subprocess.Popen[bytes] | None = None
        self._muted, self._lock = False, threading.Lock()

    def __enter__(self) -> Speaker:
        self._end_listening = self._operator.listen(self._hear)
        return self

    def __exit__(self, *_: object) -> None:
        self._end_listening()
        self.quiet(True)

    def quiet(self, yes: bool) -> None:
        with self._lock:
            self._muted = yes
            self._cut()

    def _hear(self, notice: Notice) -> None:
        sentence = notice.sentence
        if not self._able or notice.change not in SPOKEN or not sentence or sentence.startswith(NOT_SAID):
            return
        with self._lock:
            if not self._muted:
                self._cut()
                command = ["espeak-ng", "-v", self._language, "--", sentence[:LONGEST]]
                self._voice = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
                )

    def _cut(self) -> None:
        voice, self._voice = self._voice, None
        if voice is not None:
            voice.kill()
            voice.wait()
