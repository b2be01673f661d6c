"""A console without a robot: a memory of a recorded trial, an operator, and a client that can lie about who it is."""

from __future__ import annotations

import contextlib
import json
import shutil
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from websockets.sync.client import ClientConnection, connect

from behaviors.safety_policy import SafetyPolicy
from logs.trial.journal import Entry
from openbelief.pose import Pose2
from robot_app.config_sections import ConsoleSection, VoiceSection
from robot_app.console.accounts import Accounts
from robot_app.console.listening import Listening
from robot_app.console.live_pages import LivePages
from robot_app.console.open_trial import OpenTrial
from robot_app.console.server import Parts, Server, serving
from robot_app.console.snapshots import LiveMission, Snapshots
from robot_app.console.speech import PageVoice
from robot_app.console.talk import Talk
from robot_app.console.telemetry import Picture, Readings
from robot_app.console.trial_pages import TrialPages
from robot_app.mission.operator import SharedOperator
from robot_app.mission.trial_shelf import TrialShelf
from robot_app.voice.speaking import Speaker
from robot_app.voice.suggestions import memory_phrases

SMALL_ROOM = Path(__file__).parents[2] / "replay" / "small_room.mcap"
PASSWORD = "correct horse"
SOON_S = 20.0


@pytest.fixture(scope="session")
def small_room() -> OpenTrial:
    return OpenTrial(SMALL_ROOM)


@pytest.fixture(scope="session")
def accounts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("accounts") / "accounts.json"
    Accounts(path).put("ada", "operator", PASSWORD)
    Accounts(path).put("vic", "viewer", PASSWORD)
    return path


@dataclass
class Visitor:
    """A browser's part of HTTP, by hand: it keeps cookies, and says any host and origin."""

    url: str
    cookie: str = ""
    set_cookie: str = ""
    headers: dict[str, str] = field(default_factory=dict)

    def get(self, path: str) -> tuple[int, bytes, dict[str, str]]:
        return self._send(urllib.request.Request(self.url + path))

    def json(self, path: str) -> Any:
        status, body, _ = self.get(path)
        assert status == 200, (status, body)
        return json.loads(body)

    def post(self, path: str, body: object) -> tuple[int, Any]:
        data = body if isinstance(body, bytes) else json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, data, {"origin": self.url})
        status, answer, headers = self._send(request)
        if "set-cookie" in headers:
            self.set_cookie = headers["set-cookie"]
            self.cookie = self.set_cookie.split(";")[0]
        return status, json.loads(answer) if answer.startswith(b"{") else answer

    def socket(self, path: str = "/ws?page=a", **more: Any) -> ClientConnection:
        headers = {"cookie": self.cookie} if self.cookie else {}
        options = {"origin": self.url, "additional_headers": headers, "open_timeout": SOON_S} | more
        return connect(self.url.replace("http", "ws", 1) + path, **options)

    def _send(self, request: urllib.request.Request) -> tuple[int, bytes, dict[str, str]]:
        for name, value in ({"cookie": self.cookie} if self.cookie else {}).items():
            request.add_header(name, value)
        for name, value in self.headers.items():
            request.add_header(name, value)
        try:
            with urllib.request.urlopen(request, timeout=SOON_S) as answer:
                return answer.status, answer.read(), {k.lower(): v for k, v in answer.headers.items()}
        except urllib.error.HTTPError as error:
            return error.code, error.read(), {k.lower(): v for k, v in error.headers.items()}


@dataclass
class PageClient:
    """A page's socket: sends a message and finds its acknowledgement among the snapshots."""

    socket: ClientConnection
    state: dict[str, Any] = field(default_factory=dict)

    def next_state(self) -> dict[str, Any]:
        while True:
            message = json.loads(self.socket.recv(SOON_S))
            if message["type"] == "state":
                self.state |= message
                return self.state

    def say(self, **message: Any) -> dict[str, Any]:
        self.socket.send(json.dumps({"id": 9, **message}))
        while True:
            heard = json.loads(self.socket.recv(SOON_S))
            if heard["type"] == "ack":
                return heard
            self.state |= heard

    def command(self, **message: Any) -> dict[str, Any]:
        """Given in view of the newest snapshot: those that came while a test did something else are of before."""
        newest = self.next_state()
        with contextlib.suppress(TimeoutError):
            while (heard := json.loads(self.socket.recv(0.0)))["type"] == "state":
                newest = self.state = self.state | heard
        return self.say(**{"seen": newest["n"]} | message)


@dataclass
class Console:
    server: Server
    operator: SharedOperator
    live: LiveMission
    folder: Path
    kept: list[Entry]  # notes for the trial under way
    voice: PageVoice

    def visitor(self, role: str | None = "operator", name: str = "ada") -> Visitor:
        """Logged in by a pairing link; with None nobody is."""
        visitor = Visitor(self.server.url)
        if role is not None:
            token = self.server.pairing_url(name, role).split("#pair=")[1]
            assert visitor.post("/api/pair", {"token": token})[0] == 200
        return visitor


@pytest.fixture
def console(small_room: OpenTrial, accounts: Path, tmp_path: Path) -> Iterator[Console]:
    shutil.copy(SMALL_ROOM, tmp_path / "small_room.mcap")
    operator, live = SharedOperator(), LiveMission(small_room.memory)
    operator.join("console")
    kept: list[Entry] = []
    voice = PageVoice(VoiceSection())
    speaker = Speaker(operator, voice)
    readings = Readings(pose=Pose2(1.0, 2.0, 0.5), battery=0.8, disk_free_bytes=10**11)
    parts = Parts(
        operator=operator,
        snapshots=Snapshots(operator, live, lambda: readings, extra=lambda: {"speech": voice.as_json()}),
        picture=Picture(),
        live_pages=LivePages(
            operator, small_room.memory, SafetyPolicy(), SimpleNamespace(latest=lambda: small_room.grid), live
        ),
        trial_pages=TrialPages(TrialShelf(tmp_path)),
        talk=Talk(VoiceSection(), lambda: memory_phrases(small_room.memory), operator, kept.append, speaker.quiet),
        voice=voice,
    )
    with speaker, serving(Listening("127.0.0.1", 0), ConsoleSection(accounts=accounts), parts) as server:
        yield Console(server, operator, live, tmp_path, kept, voice)


@pytest.fixture
def page(console: Console) -> Iterator[PageClient]:
    """An operator's page."""
    with console.visitor().socket() as socket:
        yield PageClient(socket)


@pytest.fixture
def pages() -> type[PageClient]:
    return PageClient
