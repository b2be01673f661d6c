"""The robot's sentences as sound for the page that commands: made by espeak-ng here, or by the browser's own voice."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from robot_app.config import VoiceSection
from robot_app.console.logins import Logins, refusal
from robot_app.voice.audio import AudioError
from robot_app.voice.synthetic import installed, spoken


class PageVoice:
    """A Voice whose newest sentence is in every snapshot; a page asks for its sound by its number.

    A page plays what is new while it looks: nothing that was said before it came, and nothing twice.
    """

    def __init__(self, voice: VoiceSection) -> None:
        self._language = voice.language
        self._sound = installed("espeak-ng")
        self._lock = threading.Lock()
        self._number, self._words = 0, ""

    def say(self, words: str) -> None:
        with self._lock:
            self._number, self._words = self._number + 1, words

    def hush(self) -> None:
        with self._lock:
            self._words = ""

    def as_json(self) -> dict[str, Any]:
        """For a snapshot. words: "" where nothing is to be said. sound: whether `/api/speech/N.wav` has it."""
        with self._lock:
            return {"n": self._number, "words": self._words, "sound": self._sound, "language": self._language}

    def routes(self, logins: Logins) -> list[Route]:
        from robot_app.console.live_pages import guarded

        return [Route("/api/speech/{n:int}.wav", guarded(logins, self._wav))]

    async def _wav(self, request: Request) -> Response:
        with self._lock:
            words = self._words if request.path_params["n"] == self._number else ""
        if not words:
            return refusal(404, "That is not being said any more.")
        try:
            clip = await asyncio.to_thread(spoken, words, "espeak-ng", self._language)
        except AudioError as error:
            return refusal(503, str(error))
        return Response(clip.wav(), media_type="audio/wav")
