"""The page's talk button: sound over a socket of its own while it is held, and what was heard when it is let go."""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from logs.trial.journal import Entry
from robot_app.cli import Failure
from robot_app.config_sections import VoiceSection
from robot_app.console.sessions import Session
from robot_app.mission.operator import SharedOperator
from robot_app.voice.asking import utterance_json
from robot_app.voice.audio import MAX_S, RATE_HZ, AudioError, clip_of_pcm16
from robot_app.voice.listener import Listener, Utterance
from robot_app.voice.note import spoken_note
from robot_app.voice.recognisers import open_recogniser

HOW = "console"
BYTES_MAX = round(MAX_S * RATE_HZ) * 2
KEPT = 16  # utterances that wait to be asked
CLOSED_LOGGED_OUT = 4401


class Talk:
    """Understands what pages say. The recogniser opens at first use.

    note: keeps it in the trial under way. quiet: stops our own voice on every page while one of them listens.
    listener: instead of the one that `voice` names.
    """

    def __init__(
        self,
        voice: VoiceSection,
        phrases: Callable[[], Sequence[str]],
        operator: SharedOperator,
        note: Callable[[Entry], None],
        quiet: Callable[[bool], None] = lambda _: None,
        listener: Listener | None = None,
    ) -> None:
        self._voice, self._phrases, self._operator, self._note = voice, phrases, operator, note
        self._quiet = quiet
        self._listener = listener
        self._lock = threading.Lock()
        self._heard: OrderedDict[int, tuple[str, Utterance]] = OrderedDict()
        self._count = 0

    def notes(self, session_name: str, heard: int, asked: str) -> tuple[Entry, ...]:
        """For the trial: what that person said, as it was asked. () where nothing of theirs has that number."""
        with self._lock:
            name, utterance = self._heard.get(heard, ("", None))
        return (spoken_note(utterance, asked),) if utterance is not None and name == session_name else ()

    def understood(self, sound: bytes, who: str) -> dict[str, Any]:
        """What the page is answered. A stop has been carried out then."""
        try:
            utterance = self._ready().understand(clip_of_pcm16(sound))
        except (AudioError, Failure) as error:
            return {"type": "refused", "text": str(error)}
        if utterance.stop:
            self._operator.stop(because=f"{who} spoke: {utterance.stop.because}", who=who, how=HOW)
            self._note(spoken_note(utterance, "stop"))
        with self._lock:
            self._count += 1
            self._heard[self._count] = (who, utterance)
            while len(self._heard) > KEPT:
                self._heard.popitem(last=False)
            return {"type": "heard", "heard": self._count, **utterance_json(utterance)}

    async def socket(self, socket: WebSocket, session_of: Callable[[WebSocket], Session | None]) -> None:
        """Binary messages are mono 16 kHz s16le; a text message ends the utterance."""
        await socket.accept()
        if session_of(socket) is None:
            await socket.close(CLOSED_LOGGED_OUT)
            return
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while True:
                answer = await self._utterance(socket, session_of)
                if answer is None:
                    await socket.close(CLOSED_LOGGED_OUT)
                    return
                await socket.send_text(json.dumps(answer, allow_nan=False))

    async def _utterance(
        self, socket: WebSocket, session_of: Callable[[WebSocket], Session | None]
    ) -> dict[str, Any] | None:
        sound = await self._sound(socket, session_of)
        session = session_of(socket)
        if session is None:
            return None
        if not _operates(session):
            return {"type": "refused", "text": "You are a viewer: you may look, and STOP."}
        return await asyncio.to_thread(self.understood, sound, session.name)

    async def _sound(self, socket: WebSocket, session_of: Callable[[WebSocket], Session | None]) -> bytes:
        """Until its end; from the first block on nothing is said aloud."""
        sound = bytearray()
        with contextlib.ExitStack() as listening:
            while (message := await socket.receive()).get("text") is None:
                if message["type"] == "websocket.disconnect":
                    raise WebSocketDisconnect
                if not sound and _operates(session_of(socket)):
                    listening.enter_context(self._quietly())
                if len(sound) <= BYTES_MAX:  # what comes after that is not kept, and the utterance is refused
                    sound += message.get("bytes") or b""
        return bytes(sound)

    @contextlib.contextmanager
    def _quietly(self) -> Iterator[None]:
        self._quiet(True)
        try:
            yield
        finally:
            self._quiet(False)

    def _ready(self) -> Listener:
        """Raises Failure where there is no recogniser."""
        with self._lock:
            if self._listener is None:
                recogniser = open_recogniser(self._voice.recogniser, self._voice.language)
                self._listener = Listener(recogniser, self._phrases())
            return self._listener


def _operates(session: Session | None) -> bool:
    return session is not None and session.role == "operator"
