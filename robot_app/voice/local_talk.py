"""`openbelief run --voice`: at the terminal, an empty line begins to listen and the next one ends it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from logs.trial.journal import Entry
from robot_app.cli import Failure
from robot_app.mission.lease import Refused
from robot_app.mission.operator import SharedOperator
from robot_app.voice.audio import AudioError, clip_of_pcm16
from robot_app.voice.listener import Listener, Utterance
from robot_app.voice.note import spoken_note

HOW = "voice"
LISTENING = "Listening: press Enter when you have said it."
ASK = "Type ask to ask that, or type what you meant."


class Microphone(Protocol):
    def start(self) -> None: ...

    def stop(self) -> bytes:
        """Mono 16 kHz s16le since `start`."""
        ...


class LocalTalk:
    """quiet: stops our own voice while listening. note: keeps a spoken stop in the trial under way."""

    def __init__(
        self,
        operator: SharedOperator,
        microphone: Microphone,
        listener: Listener,
        note: Callable[[Entry], None],
        quiet: Callable[[bool], None] = lambda _: None,
    ) -> None:
        self._operator, self._microphone, self._listener = operator, microphone, listener
        self._note, self._quiet = note, quiet
        self._listening = False
        self._heard: Utterance | None = None

    def turn(self) -> None:
        """An empty line: listen, or understand what was said."""
        try:
            if self._listening:
                self._listening = False
                self._understand(self._microphone.stop())
            else:
                self._quiet(True)
                self._microphone.start()
                self._listening = True
                self._operator.tell(LISTENING)
        except (AudioError, Failure) as error:
            self._operator.tell(str(error))
        finally:
            if not self._listening:
                self._quiet(False)

    def ask(self) -> None:
        """Ask what was heard last."""
        heard, self._heard = self._heard, None
        if heard is None:
            self._operator.tell("Nothing was heard yet: press Enter, say it, and press Enter.")
            return
        try:
            notes = (spoken_note(heard, heard.transcript),)
            self._operator.ask(self._operator.lease, heard.transcript, notes)
        except Refused as refused:
            self._operator.tell(str(refused))

    def _understand(self, sound: bytes) -> None:
        heard = self._listener.understand(clip_of_pcm16(sound))
        if heard.stop:
            self._operator.stop(because=heard.stop.because, how=HOW)
            self._note(spoken_note(heard, "stop"))
            return
        self._heard = heard
        meant = "".join(f" Did you mean: {each.sentence}?" for each in heard.suggestions)
        self._operator.tell(f"Heard {heard.told}.{meant} {ASK}")
