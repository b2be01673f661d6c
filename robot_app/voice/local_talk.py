"""`openbelief run --voice`: at the terminal, an empty line begins to listen and the next one ends it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Protocol

from logs.trial.journal import Entry
from robot_app.cli import Failure
from robot_app.mission.operator import SharedOperator
from robot_app.voice.audio import AudioError, clip_of_pcm16
from robot_app.voice.listener import Listener, Utterance
from robot_app.voice.note import spoken_note

HOW = "voice"
LISTENING = "Listening: press Enter when you have said it."
ASK = "Type ask to ask that, or type what you meant."
ANSWER = "A question is open, and its answer is typed; a spoken stop counts at any time."
NOTHING_YET = "Nothing was heard yet: press Enter, say it, and press Enter."
Ask = Callable[[str, tuple[Entry, ...]], None]
Act = Callable[[], None]


class Microphone(Protocol):
    def start(self) -> None: ...

    def stop(self) -> bytes:
        """Mono 16 kHz s16le since `start`."""
        ...


def in_a_thread(act: Act) -> None:
    """Understanding takes a second or more: a stop that is typed meanwhile does not wait for it."""
    threading.Thread(target=act, name="understanding", daemon=True).start()


class LocalTalk:
    """ask: asks with the terminal's lease; raises Refused. note: keeps a spoken stop in the trial under way.

    who: stops. quiet: stops our own voice while listening. beside: where what was said is understood.
    """

    def __init__(
        self,
        operator: SharedOperator,
        microphone: Microphone,
        listener: Listener,
        *,
        ask: Ask,
        note: Callable[[Entry], None],
        who: str = "",
        quiet: Callable[[bool], None] = lambda _: None,
        beside: Callable[[Act], None] = in_a_thread,
    ) -> None:
        self._operator, self._microphone, self._listener = operator, microphone, listener
        self._ask, self._note, self._who, self._quiet, self._beside = ask, note, who, quiet, beside
        self._listening = False
        self._heard: Utterance | None = None

    def turn(self) -> None:
        """An empty line, also while a question is open: listen, or understand what was said."""
        try:
            self._end() if self._listening else self._begin()
        except Failure as error:
            self._operator.tell(str(error))

    def ask(self) -> None:
        """Ask what was heard last. Raises Refused where somebody else commands."""
        heard, self._heard = self._heard, None
        if heard is None:
            self._operator.tell(NOTHING_YET)
        else:
            self._ask(heard.transcript, (spoken_note(heard, heard.transcript),))

    def _begin(self) -> None:
        self._quiet(True)
        try:
            self._microphone.start()
        except BaseException:
            self._quiet(False)
            raise
        self._listening = True
        self._operator.tell(LISTENING)

    def _end(self) -> None:
        self._listening = False
        try:
            sound = self._microphone.stop()
        finally:
            self._quiet(False)
        self._beside(lambda: self._understand(sound))

    def _understand(self, sound: bytes) -> None:
        try:
            heard = self._listener.understand(clip_of_pcm16(sound))
        except (AudioError, Failure) as error:
            self._operator.tell(str(error))
            return
        if heard.stop:
            self._operator.stop(because=heard.stop.because, who=self._who, how=HOW)
            self._note(spoken_note(heard, "stop"))
        elif self._operator.question is not None:
            self._operator.tell(f"Heard {heard.told}. {ANSWER}")
        else:
            self._heard = heard
            meant = "".join(f" Did you mean: {each.sentence}?" for each in heard.suggestions)
            self._operator.tell(f"Heard {heard.told}.{meant} {ASK}")
