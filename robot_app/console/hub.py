"""The live connections: each page gets the newest snapshot, and its commands are obeyed as they come."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from robot_app.console.commands import Commands, Page
from robot_app.console.sessions import Session, TokenBucket
from robot_app.console.snapshots import Snapshots
from robot_app.console.telemetry import Picture
from robot_app.mission.notices import Notice
from robot_app.mission.operator import SharedOperator

TICK_S = 0.1
CAMERA_S = 0.1  # at most ten pictures a second
COMMANDS_PER_S, COMMANDS_BURST = 40.0, 80  # signs of life included
PAGES_MAX = 32
CLOSED_LOGGED_OUT, CLOSED_TOO_MANY, CLOSED_FLOOD = 4401, 4429, 4408


@dataclass(eq=False)
class Connection:
    """One open socket. sent: the last snapshot's number; mission, said: what this page has of them already."""

    socket: WebSocket
    page: Page
    session: Session
    news: asyncio.Event = field(default_factory=asyncio.Event)
    acks: list[dict[str, Any]] = field(default_factory=list)
    sent: int = 0
    mission: object = None
    said: object = None


class Hub:
    """Runs in the server's event loop; `wake` may be called from any thread."""

    def __init__(
        self,
        operator: SharedOperator,
        commands: Commands,
        snapshots: Snapshots,
        picture: Picture,
        session_of: Callable[[WebSocket], Session | None],
    ) -> None:
        self._operator, self._commands, self._snapshots = operator, commands, snapshots
        self._picture, self._session_of = picture, session_of
        self._connections: set[Connection] = set()
        self._pages: dict[tuple[str, str], Page] = {}
        self._rate = TokenBucket(COMMANDS_PER_S, COMMANDS_BURST)
        self._newest: dict[str, Any] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._due: asyncio.Event | None = None

    async def run(self) -> None:
        """Make a snapshot at every tick, and at once when something happens."""
        self._loop, self._due = asyncio.get_running_loop(), asyncio.Event()
        end_listening = self._operator.listen(self.wake)
        try:
            while True:
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._due.wait(), TICK_S)
                self._due.clear()
                if self._connections:
                    self._newest = self._snapshots.make()
                    for connection in self._connections:
                        connection.news.set()
        finally:
            end_listening()

    def wake(self, _: Notice | None = None) -> None:
        if self._loop is not None and self._due is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._due.set)

    async def page_socket(self, socket: WebSocket) -> None:
        session = self._session_of(socket)
        await socket.accept()
        if session is None or len(self._connections) >= PAGES_MAX:
            await socket.close(CLOSED_LOGGED_OUT if session is None else CLOSED_TOO_MANY)
            return
        page_id = socket.query_params.get("page", "")[:64]
        page = self._pages.setdefault((session.token, page_id), Page(session.name, session.role, page_id))
        connection = Connection(socket, page, session)
        self._connections.add(connection)
        sending = asyncio.create_task(self._send(connection))
        try:
            await self._receive(connection)
        except (WebSocketDisconnect, RuntimeError):
            pass  # it went away: its lease stays, and falls silent
        finally:
            self._connections.discard(connection)
            sending.cancel()
            with contextlib.suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError):
                await sending

    async def _receive(self, connection: Connection) -> None:
        socket, page = connection.socket, connection.page
        while True:
            text = await _received(socket)
            stops = '"stop"' in text  # STOP is never too much
            if self._session_of(socket) is None:
                await socket.close(CLOSED_LOGGED_OUT)
                return
            if not stops and not self._rate.allows(connection.session.token):
                await socket.close(CLOSED_FLOOD)
                return
            acknowledged = self._commands.obey(page, text)
            if acknowledged is not None:
                connection.acks.append(acknowledged)
                connection.news.set()

    async def _send(self, connection: Connection) -> None:
        while True:
            await connection.news.wait()
            connection.news.clear()
            acks, connection.acks = connection.acks, []
            for acknowledged in acks:
                await connection.socket.send_text(json.dumps(acknowledged))
            if self._newest and self._newest["n"] != connection.sent:
                connection.sent = self._newest["n"]
                await connection.socket.send_text(json.dumps(self._for(connection, self._newest), allow_nan=False))

    def _for(self, connection: Connection, snapshot: dict[str, Any]) -> dict[str, Any]:
        """The snapshot with what this page alone knows, without what it has already."""
        page, lease = connection.page, self._operator.lease
        mine = page.lease if page.lease is not None and page.lease == lease else None
        shown = dict(snapshot)
        shown["you"] = {
            "name": page.name,
            "role": page.role,
            "epoch": page.lease.epoch if mine and page.lease else None,
        }
        for key in ("mission", "said"):
            if shown[key] is getattr(connection, key) or shown[key] == getattr(connection, key):
                del shown[key]
            else:
                setattr(connection, key, shown[key])
        return shown

    async def camera_socket(self, socket: WebSocket) -> None:
        """One picture after the other, the next one when the last one was shown: 8 bytes of stamp, then the JPEG."""
        if self._session_of(socket) is None:
            await socket.accept()
            await socket.close(CLOSED_LOGGED_OUT)
            return
        await socket.accept()
        shown = -1
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while self._session_of(socket) is not None:
                picture = await asyncio.to_thread(self._picture.newest)
                if picture is not None and picture[0] != shown:
                    shown = picture[0]
                    await socket.send_bytes(shown.to_bytes(8, "big") + picture[1])
                    await _received(socket)
                await asyncio.sleep(CAMERA_S)


async def _received(socket: WebSocket) -> str:
    """The next message; "" for bytes, which are no command. Raises WebSocketDisconnect."""
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1000))
    return message.get("text") or ""
