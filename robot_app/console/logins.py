"""Logging in and out: by name and password, or by a pairing token from the terminal."""

from __future__ import annotations

import asyncio
import json
from typing import Any

from starlette.requests import HTTPConnection, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from openbelief.documents import from_json
from robot_app.cli import Failure
from robot_app.console.accounts import Accounts
from robot_app.console.doors import BODY_MAX
from robot_app.console.sessions import SESSION_S, Session, Sessions, TokenBucket

COOKIE = "openbelief_session"
TRIES_PER_S, TRIES_BURST = 0.1, 5  # a guess costs 0.2 s of a core: not many of them, whoever asks
PAIRINGS_PER_S, PAIRINGS_BURST = 1.0, 20  # a token of 24 random bytes is not guessed
AT_ONCE = 2
UNREADABLE = "The accounts cannot be read now: openbelief accounts list says why. A link from the terminal logs in."


class Logins:
    """The routes, and who is behind a request."""

    def __init__(self, sessions: Sessions, accounts: Accounts, *, tls: bool) -> None:
        self._sessions, self._accounts, self._tls = sessions, accounts, tls
        self._tries, self._pairings = TokenBucket(TRIES_PER_S, TRIES_BURST), TokenBucket(PAIRINGS_PER_S, PAIRINGS_BURST)
        self._at_once = asyncio.Semaphore(AT_ONCE)

    @property
    def routes(self) -> list[Route]:
        return [
            Route("/api/me", self._me),
            Route("/api/login", self._login, methods=["POST"]),
            Route("/api/pair", self._pair, methods=["POST"]),
            Route("/api/logout", self._logout, methods=["POST"]),
        ]

    def session(self, connection: HTTPConnection) -> Session | None:
        return self._sessions.find(connection.cookies.get(COOKIE))

    async def _me(self, request: Request) -> Response:
        session = self.session(request)
        return refusal(401, "Log in first.") if session is None else JSONResponse(_who(session))

    async def _login(self, request: Request) -> Response:
        if not self._tries.allows(request.client.host if request.client else ""):
            return refusal(429, "Too many tries: wait ten seconds.")
        given = await body_of(request)
        name, password = given.get("name"), given.get("password")
        if not isinstance(name, str) or not isinstance(password, str):
            return refusal(400, "A name and a password are needed.")
        async with self._at_once:
            try:
                account = await asyncio.to_thread(self._accounts.verify, name, password)
            except Failure:  # which file it is, and what is wrong with it, is nobody's business who is not logged in
                return refusal(503, UNREADABLE)
        if account is None:
            return refusal(401, "That name and password do not belong together.")
        return self._opened(self._sessions.open(account.name, account.role))

    async def _pair(self, request: Request) -> Response:
        if not self._pairings.allows(""):
            return refusal(429, "Too many tries: wait a second.")
        token = (await body_of(request)).get("token")
        session = self._sessions.pair(token) if isinstance(token, str) else None
        if session is None:
            return refusal(401, "That link was used already, or is older than ten minutes. Ask for a new one.")
        return self._opened(session)

    async def _logout(self, request: Request) -> Response:
        if (session := self.session(request)) is not None:
            self._sessions.close(session.token)
        response = JSONResponse({})
        response.delete_cookie(COOKIE)
        return response

    def _opened(self, session: Session) -> Response:
        response = JSONResponse(_who(session))
        response.set_cookie(
            COOKIE, session.token, max_age=int(SESSION_S), httponly=True, samesite="strict", secure=self._tls
        )
        return response


async def body_of(request: Request) -> dict[str, Any]:
    """The JSON object of a request's body; {} where it is none, or holds half a character that nothing could write."""
    try:
        found = from_json((await request.body())[:BODY_MAX])
        json.dumps(found, ensure_ascii=False).encode()
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def refusal(status: int, sentence: str) -> Response:
    return JSONResponse({"error": sentence}, status_code=status)


def _who(session: Session) -> dict[str, str]:
    return {"name": session.name, "role": session.role}
