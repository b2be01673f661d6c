"""The robot's sentences as sound for the page that commands: made by espeak-ng here, or by the browser's own voice."""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from robot_app.config_sections import VoiceSection
from robot_app.console.logins import Logins, refusal
from robot_app.voice.audio import AudioError
from robot_app.voice.synthetic import installed, spoken

KEPT = 3  # sentences: what is older than these is no news any more


class PageVoice:
    """A Voice whose newest sentences are in every snapshot; a page asks for each one's sound by its number.

    A page says them one after the other while it looks: nothing that was said before it came, and nothing twice.
    """

    def __init__(self, voice: VoiceSection) -> None:
        self._language = voice.language
        self._sound = installed("espeak-ng")
        self._lock = threading.Lock()
        self._number = 0
        self._said: deque[tuple[int, str]] = deque(maxlen=KEPT)

    def say(self, words: str) -> None:
        with self._lock:
            self._number += 1
            self._said.append((self._number, words))

    def hush(self) -> None:
        with self._lock:
            self._said.clear()

    def as_json(self) -> dict[str, Any]:
        """For a snapshot. n: of the last sentence ever. sound: whether `/api/speech/N.wav` has what is in `said`."""
        with self._lock:
            said = [{"n": n, "words": words} for n, words in self._said]
            return {"n": self._number, "said": said, "sound": self._sound, "language": self._language}

    def routes(self, logins: Logins) -> list[Route]:
        from robot_app.console.live_pages import guarded

        return [Route("/api/speech/{n:int}.wav", guarded(logins, self._wav))]

    async def _wav(self, request: Request) -> Response:
        with self._lock:
            words = dict(self._said).get(request.path_params["n"])
        if words is None:
            return refusal(404, "That is not being said any more.")
        try:
            clip = await asyncio.to_thread(spoken, words, "espeak-ng", self._language)
        except AudioError as error:
            return refusal(503, str(error))
        return Response(clip.wav(), media_type="audio/wav")
