"""The console's server: Starlette behind uvicorn, on a thread of its own beside the missions."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import socket
import ssl
import sys
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from robot_app.cli import Failure
from robot_app.config_sections import ConsoleSection
from robot_app.console.accounts import Accounts, Role
from robot_app.console.commands import Commands
from robot_app.console.doors import Address, Doors
from robot_app.console.hub import Hub
from robot_app.console.listening import Listening, address_of, bound_socket, checked
from robot_app.console.live_pages import LivePages
from robot_app.console.logins import Logins
from robot_app.console.sessions import Sessions
from robot_app.console.snapshots import Snapshots
from robot_app.console.speech import PageVoice
from robot_app.console.talk import Talk
from robot_app.console.telemetry import Picture
from robot_app.console.trial_pages import TrialPages
from robot_app.mission.operator import SharedOperator

STATIC = Path(__file__).parent / "static"
WS_MESSAGE_MAX = 16 << 10
SWITCH_S = 0.0005  # a busy mission thread gives the interpreter up this often: a STOP waits no longer for it
START_S = 10.0
TIDY_S = 10.0
NEVER = 1 << 30


@dataclass(frozen=True)
class Parts:
    """What the server shows and obeys."""

    operator: SharedOperator
    snapshots: Snapshots
    picture: Picture
    live_pages: LivePages
    trial_pages: TrialPages
    talk: Talk | None = None
    voice: PageVoice | None = None


class Server:
    """A running console. url: where a browser finds it. reachable: from other machines too."""

    def __init__(self, address: Address, sessions: Sessions, *, reachable: bool) -> None:
        self.address, self._sessions, self.reachable = address, sessions, reachable

    @property
    def url(self) -> str:
        return self.address.url

    def pairing_url(self, name: str, role: Role) -> str:
        """A link that logs one page in, once. The token is behind a #: no server log and no referrer holds it."""
        return f"{self.url}/#pair={self._sessions.pairing(name, role)}"


@contextmanager
def serving(listening: Listening, settings: ConsoleSection, parts: Parts) -> Iterator[Server]:
    """Serve until the end of the block. Raises Failure where it must not or cannot."""
    accounts = Accounts(settings.accounts)
    checked(listening, settings, accounts)
    bound = bound_socket(listening)
    address = address_of(Listening(listening.host, bound.getsockname()[1]), settings)
    sessions = Sessions()
    logins = Logins(sessions, accounts, tls=address.tls)
    app = _app(parts, logins, address)
    with _prompt(), _running(app, bound, settings):
        yield Server(address, sessions, reachable=not listening.loopback)


@contextmanager
def _prompt() -> Iterator[None]:
    """No thread keeps a STOP waiting: neither one that computes, nor the collector of garbage, which stops them all.

    A full collection over a memory and its encoder took 0.14 s: it runs while the robot has nothing to do (`_tidy`).
    """
    interval, thresholds = sys.getswitchinterval(), gc.get_threshold()
    sys.setswitchinterval(SWITCH_S)
    gc.set_threshold(*thresholds[:2], NEVER)
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        gc.set_threshold(*thresholds)
        sys.setswitchinterval(interval)


async def _tidy(operator: SharedOperator) -> None:
    while True:
        await asyncio.sleep(TIDY_S)
        if operator.mission is None:
            gc.collect()


def _app(parts: Parts, logins: Logins, address: Address) -> Any:
    from starlette.applications import Starlette
    from starlette.responses import FileResponse, Response
    from starlette.routing import Mount, Route, WebSocketRoute
    from starlette.staticfiles import StaticFiles

    commands = Commands(parts.operator, parts.snapshots, parts.talk)
    hub = Hub(parts.operator, commands, parts.snapshots, parts.picture, logins.session)

    async def index(_: Any) -> Response:
        return FileResponse(STATIC / "index.html")

    talking = []
    if (talk := parts.talk) is not None:
        talking = [WebSocketRoute("/ws/voice", lambda socket: talk.socket(socket, logins.session))]

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        jobs = (hub.run(), parts.trial_pages.read(), _tidy(parts.operator))
        tasks = [asyncio.create_task(job) for job in jobs]
        try:
            yield
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    routes = [
        Route("/", index),
        Mount("/static", StaticFiles(directory=STATIC)),
        WebSocketRoute("/ws", hub.page_socket),
        WebSocketRoute("/ws/camera", hub.camera_socket),
        *talking,
        *logins.routes,
        *parts.live_pages.routes(logins),
        *parts.trial_pages.routes(logins),
        *(parts.voice.routes(logins) if parts.voice else ()),
    ]
    return Doors(Starlette(routes=routes, lifespan=lifespan), address)


@contextmanager
def _running(app: Any, bound: socket.socket, settings: ConsoleSection) -> Iterator[None]:
    import uvicorn

    config = uvicorn.Config(
        app,
        log_config=None,
        access_log=False,
        server_header=False,
        ws="websockets-sansio",
        ws_max_size=WS_MESSAGE_MAX,
        ws_per_message_deflate=False,
        ws_ping_interval=5.0,
        ws_ping_timeout=5.0,
        limit_concurrency=200,
        timeout_graceful_shutdown=1,
        ssl_certfile=str(settings.certificate) if settings.certificate else None,
        ssl_keyfile=str(settings.key) if settings.key else None,
    )
    try:
        config.load()
    except (OSError, ssl.SSLError) as error:
        raise Failure(f"The console's certificate cannot be used: {error}") from error  # it was changed just now
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [bound]}, name="console", daemon=True)
    thread.start()
    try:
        _await_start(server, thread)
        yield
    finally:
        server.should_exit = True
        thread.join(START_S)
        bound.close()


def _await_start(server: Any, thread: threading.Thread) -> None:
    ended = threading.Event()
    for _ in range(round(START_S / 0.02)):
        if server.started:
            return
        if not thread.is_alive():
            break
        ended.wait(0.02)
    raise Failure("The console's server did not start.")
