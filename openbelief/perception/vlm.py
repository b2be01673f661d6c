"""PhraseProposer over any OpenAI-compatible server: vLLM, SGLang, llama.cpp, Ollama."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from threading import Event, Lock
from typing import Any, TypeVar

from pydantic import BaseModel, Field, ValidationError

from openbelief.observation import RgbdFrame
from openbelief.perception.ports import FrameUnseen
from openbelief.perception.retry import (
    Outage,
    RateLimiter,
    RetryClock,
    RetryPolicy,
    RetryStopped,
    TransientFailure,
    patiently,
)
from openbelief.perception.vlm_config import VlmConfig
from openbelief.perception.vlm_errors import BadAnswer, VlmError, translated
from openbelief.perception.vlm_picture import data_url
from openbelief.perception.vlm_prompt import DECODING, MAX_PHRASES, PROMPT, messages, prompt_id
from openbelief.perception.vlm_reply import Garbage, phrases_of
from openbelief.phrase import printable

Answer = TypeVar("Answer")

TRIES_A_FRAME = 3  # batching makes even temperature 0 differ a little between tries
BAD_FRAMES_IN_A_ROW = 5  # one odd picture is skipped; five say that the model or the server is wrong
CONNECT_S = 5.0


class VlmProposer:
    """Asks for a frame's phrases; waits for a server that is away, within its patience. Threads may share it.

    tell: hears in one sentence that the server is away, and that it is back.
    """

    def __init__(self, config: VlmConfig, clock: RetryClock, *, tell: Callable[[str], None]) -> None:
        self.config, self._clock = config, clock
        self._pace = RateLimiter(config.requests_per_minute, clock)
        self._outage, self._patience = Outage(tell), RetryPolicy(config.patience_s)
        self._stop = Event()
        self._bad_lock, self._bad_in_a_row = Lock(), 0

    @property
    def id(self) -> str:
        """Model, prompt, decoding and picture; where it is served does not matter."""
        return f"vlm {self.config.model}, {prompt_id()}, {self.config.picture}"

    @property
    def about(self) -> dict[str, Any]:
        """What the id stands for, in full, for the memory."""
        return {"model": self.config.model, "prompt": PROMPT, "max_phrases": MAX_PHRASES, **DECODING}

    def check(self) -> None:
        """Ask what is served, without patience. Raises VlmError: not reachable, refused, or another model."""
        try:
            served = self._translating(lambda: [model.id for model in self._client.models.list().data])
        except (TransientFailure, BadAnswer) as trouble:
            raise VlmError(str(trouble)) from trouble
        if self.config.model not in served:
            names = printable(", ".join(map(str, served)) or "nothing", 200)
            raise VlmError(
                f"The model server at {self.config.endpoint} serves {names}, not {self.config.model}: "
                "correct the profile's model, or serve that one."
            )

    def propose(self, frame: RgbdFrame) -> list[str]:
        """At most 20 phrases. Raises FrameUnseen, VlmError, and RetryStopped after `close`."""
        url = data_url(frame.color, self.config.picture)
        for tries_left in reversed(range(TRIES_A_FRAME)):
            try:
                phrases = self._patiently(lambda: self._translating(lambda: self._phrases(url)))
            except BadAnswer as bad:
                if not tries_left:
                    raise self._unseen(bad) from bad
            else:
                self._count(0)
                return phrases
        raise AssertionError("the last try returns or raises")

    def close(self) -> None:
        """End waiting and requests under way."""
        self._stop.set()
        if "_client" in self.__dict__:
            self._client.close()

    @cached_property
    def _client(self) -> Any:
        """Retries are ours, so that the clock is; no environment variable lends its key to somebody's endpoint."""
        import openai

        timeout = openai.Timeout(self.config.timeout_s, connect=min(CONNECT_S, self.config.timeout_s))
        key = self.config.api_key or "none"
        return openai.OpenAI(base_url=self.config.endpoint, api_key=key, timeout=timeout, max_retries=0)

    def _phrases(self, url: str) -> list[str]:
        self._pace.wait_turn()
        answer = self._client.chat.completions.with_raw_response.create(
            model=self.config.model, messages=messages(url), **DECODING
        )
        try:
            choice = _Completion.model_validate_json(answer.http_response.content).choices[0]
            return phrases_of(choice.message.content or "", cut=choice.finish_reason == "length")
        except ValidationError as error:
            raise BadAnswer(f"The model server at {self.config.endpoint} sent no chat completion.") from error
        except Garbage as garbage:
            raise BadAnswer(f"The reply of {self.config.model} cannot be used: {garbage}.") from garbage

    def _translating(self, ask: Callable[[], Answer]) -> Answer:
        import openai

        if self._stop.is_set():
            raise RetryStopped("Stopped before a request was sent.")
        try:
            return ask()
        except (openai.OpenAIError, ValueError) as error:
            if self._stop.is_set():
                raise RetryStopped("Stopped while a request was under way.") from error
            config = self.config
            raise translated(error, config.endpoint, config.model, config.timeout_s) from error

    def _patiently(self, ask: Callable[[], Answer]) -> Answer:
        try:
            return patiently(ask, self._patience, self._clock, outage=self._outage, stopped=self._stop.is_set)
        except TransientFailure as trouble:
            raise VlmError(f"{trouble} Waited {self.config.patience_s:.0f} s for it.") from trouble

    def _unseen(self, bad: BadAnswer) -> FrameUnseen | VlmError:
        if (count := self._count(1)) < BAD_FRAMES_IN_A_ROW:
            return FrameUnseen(f"no phrases: {bad}")
        return VlmError(
            f"{bad} That is {count} frames in a row: look at what {self.config.model} replies, "
            "and whether it is served as a vision model."
        )

    def _count(self, bad: int) -> int:
        """Bad frames in a row; a good one begins anew."""
        with self._bad_lock:
            self._bad_in_a_row = self._bad_in_a_row + bad if bad else 0
            return self._bad_in_a_row


class _Message(BaseModel):
    content: str | None = None


class _Choice(BaseModel):
    message: _Message
    finish_reason: str | None = None


class _Completion(BaseModel):
    """The part of a chat completion that is used."""

    choices: list[_Choice] = Field(min_length=1)
