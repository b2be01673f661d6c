"""What every request passes: the host and origin that it names, its size, and what the answer forbids the browser."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, MutableMapping
from dataclasses import dataclass
from typing import Any

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

BODY_MAX = 16 << 10
POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' blob:",
        "connect-src 'self'",
        "manifest-src 'self'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    )
)
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=(self)",
    "cache-control": "no-store",
}
SAFE_METHODS = ("GET", "HEAD")


@dataclass(frozen=True)
class Address:
    """Where the console is reached. hosts: HOST:PORT as browsers name it."""

    hosts: tuple[str, ...]
    tls: bool

    @property
    def origins(self) -> frozenset[str]:
        scheme = "https" if self.tls else "http"
        return frozenset(f"{scheme}://{host}" for host in self.hosts)

    @property
    def url(self) -> str:
        return f"{'https' if self.tls else 'http'}://{self.hosts[0]}"


class Doors:
    """ASGI middleware. A page of another site neither reads nor commands; a name that is not ours is no way in."""

    def __init__(self, app: App, address: Address) -> None:
        self._app, self._address = app, address

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        refused = self._refusal(scope)
        if refused is None:
            await self._app(scope, receive, _with_headers(send))
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 4403, "reason": refused})
        else:
            await _answer(_with_headers(send), 403, refused)

    def _refusal(self, scope: Scope) -> str | None:
        named = {key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]}
        if named.get("host", "").lower() not in self._address.hosts:
            return "This console does not answer to that host name: open the address that its terminal names."
        origin = named.get("origin")
        changes = scope["type"] == "websocket" or scope["method"] not in SAFE_METHODS
        if (changes or origin is not None) and origin not in self._address.origins:
            return "That came from a page of another site."
        return _too_much(named) if scope["type"] == "http" else None


def _too_much(named: dict[str, str]) -> str | None:
    """A body that does not say its length (chunked) would be kept whole before anybody asks who sends it."""
    length = named.get("content-length", "0")
    if "transfer-encoding" in named or not length.isdecimal() or int(length) > BODY_MAX:
        return f"That is too large: {BODY_MAX >> 10} KiB, told beforehand, is the limit."
    return None


def _with_headers(send: Send) -> Send:
    async def sent(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            own = {key.lower() for key, _ in message.get("headers", [])}
            more = [(k.encode(), v.encode()) for k, v in HEADERS.items() if k.encode() not in own]
            message = {**message, "headers": [*message.get("headers", []), *more]}
        await send(message)

    return sent


async def _answer(send: Send, status: int, text: str) -> None:
    body = text.encode()
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
