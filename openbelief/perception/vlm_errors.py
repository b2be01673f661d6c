"""What can go wrong between us and a served model: each with its cause, its remedy, and whether waiting helps."""

from __future__ import annotations

import ssl
from dataclasses import dataclass
from email.utils import parsedate_to_datetime
from typing import TYPE_CHECKING, Literal

from openbelief.perception.ports import PerceptionFailed
from openbelief.perception.retry import TransientFailure
from openbelief.phrase import printable

if TYPE_CHECKING:
    import openai


class VlmError(PerceptionFailed):
    """The endpoint cannot be used as it is configured."""


class BadAnswer(RuntimeError):
    """This one request got no usable answer, from a server that is there."""


Kind = Literal["wait", "frame", "end"]


@dataclass(frozen=True)
class Trouble:
    """kind: wait = the server may come back; frame = it concerns this request; end = a person must mend it."""

    kind: Kind
    sentence: str


# Status -> what it means. {model} and {said}, the server's own words, are filled in.
STATUSES = {
    400: Trouble("end", "refuses the request: {said}. Serve {model} as a vision model, an image a prompt allowed"),
    401: Trouble("end", "refuses our key: put a valid one into the environment variable that api_key_env names"),
    403: Trouble("end", "forbids our key to use {model}: put another into the variable that api_key_env names"),
    404: Trouble("end", "does not know {model} or this path: {said}. The endpoint should end in /v1"),
    408: Trouble("wait", "gave up on a request"),
    413: Trouble("end", "finds the image too large: lower max_side_px"),
    422: Trouble("end", "refuses the request: {said}. Serve {model} as a vision model"),
    429: Trouble("wait", "is asked too often: {said}"),
    502: Trouble("wait", "has nobody behind it"),
    503: Trouble("wait", "is not ready: {said}"),
    504: Trouble("wait", "gets no answer from behind it"),
}
REFUSED_OTHERWISE = Trouble("end", "answers {status}: {said}")
BROKEN_OTHERWISE = Trouble("frame", "answers {status}: {said}")


def translated(
    error: openai.OpenAIError | ValueError, endpoint: str, model: str, timeout_s: float
) -> VlmError | BadAnswer | TransientFailure:
    """The client's exception in our words."""
    import openai

    where = f"The model server at {endpoint}"
    if isinstance(error, openai.APITimeoutError):
        return TransientFailure(
            f"{where} does not answer within {timeout_s:.0f} s: raise timeout_s, or lower max_side_px."
        )
    if isinstance(error, openai.APIConnectionError):
        return _unreachable(error, where)
    if not isinstance(error, openai.APIStatusError):
        return BadAnswer(f"{where} does not speak the protocol: {printable(str(error))}.")
    status = error.status_code
    trouble = STATUSES.get(status, BROKEN_OTHERWISE if status >= 500 else REFUSED_OTHERWISE)
    words = trouble.sentence.format(status=status, said=_said(error), model=model)
    sentence = f"{where} {words} (HTTP {status})."
    if trouble.kind == "wait":
        return TransientFailure(sentence, _retry_after_s(error))
    return VlmError(sentence) if trouble.kind == "end" else BadAnswer(sentence)


def _unreachable(error: BaseException, where: str) -> VlmError | TransientFailure:
    causes = [error]
    while (cause := causes[-1].__cause__ or causes[-1].__context__) is not None:
        causes.append(cause)
    why = printable(str(causes[-1])) or type(causes[-1]).__name__
    if any(isinstance(each, ssl.SSLCertVerificationError) for each in causes):
        return VlmError(f"{where} has a certificate that this machine does not trust: {why}.")
    return TransientFailure(f"{where} cannot be reached ({why}): start it, or correct the endpoint.")


def _said(error: openai.APIStatusError) -> str:
    """The server's own message, as data: printable and short."""
    body = error.body if isinstance(error.body, dict) else {}
    return printable(str(body.get("message") or error.response.text), 160) or "no reason given"


def _retry_after_s(error: openai.APIStatusError) -> float:
    """Retry-After in seconds, or until a date by the server's own clock; 0 where neither can be read."""
    headers = error.response.headers
    text = headers.get("retry-after", "")
    if text.isdigit():
        return float(text)
    try:
        until, now = parsedate_to_datetime(text), parsedate_to_datetime(headers.get("date", ""))
        return max((until - now).total_seconds(), 0.0)
    except (TypeError, ValueError):  # no date, or one with and one without a time zone
        return 0.0
