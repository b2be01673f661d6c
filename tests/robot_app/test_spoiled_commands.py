"""What pages and other programs send is answered, whatever it is: a refusal, no exception, and nothing is done."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from openbelief.memory import ObjectMemory
from robot_app.console.commands import Commands, Page
from robot_app.mission.operator import SharedOperator
from robot_app.remote import messages as m
from robot_app.remote.server import RemoteServer
from robot_app.text_encoders import text_encoder_by_id

DEEP = json.loads("[" * 200 + "]" * 200)
WORST = [None, True, -1, 0, 1 << 70, 10**400, 1e308, "", "x" * 100_000, "\x1b[2J\n", "\u202e", [], {}, DEEP, [1] * 1000]
BROKEN = [b"", b"{", b"[]", b"7", b"null", b"\xff\xfe", b"[" * 100_000, b'{"a":' * 10_000]
BROKEN += [b'"\\ud800"', b"NaN", b'{"x": 1e999}']
REQUESTS = {
    "lease": {"who": "ada", "over": False},
    "beat": {"token": "t", "epoch": 1},
    "release": {"token": "t", "epoch": 1},
    "ask": {"token": "t", "epoch": 1, "sentence": "go to the sofa"},
    "confirm": {"token": "t", "epoch": 1, "question": 1, "memory_hash": "0", "answer": "yes", "number": 0},
    "propose": {"sentence": "go to the sofa", "agent": "a"},
    "stop": {"who": "ada", "agent": False},
    "status": {"since": 0},
    "candidates": {"sentence": "sofa", "limit": 3},
    "why": {"object_id": 0},
}
COMMANDS = [
    {"type": "beat", "id": 1, "seen": 1},
    {"type": "take", "id": 1, "seen": 1, "over": False},
    {"type": "release", "id": 1, "seen": 1},
    {"type": "ask", "id": 1, "seen": 1, "epoch": 1, "text": "go to the sofa", "heard": 0},
    {"type": "answer", "id": 1, "seen": 1, "epoch": 1, "question": 1, "memory_hash": "0", "word": "yes", "number": 0},
]


def spoiled(values: dict) -> Iterator[bytes]:
    """Each field worst, each field gone, one more, and the bytes themselves changed."""
    for name in values:
        for worst in WORST:
            yield json.dumps(values | {name: worst}).encode()
        yield json.dumps({other: value for other, value in values.items() if other != name}).encode()
    yield json.dumps(values | {"more": 1}).encode()
    whole, rng = json.dumps(values).encode(), np.random.default_rng(0)
    for _ in range(100):
        data = bytearray(whole)
        data[int(rng.integers(len(data)))] = int(rng.integers(256))
        yield bytes(data[: int(rng.integers(len(data) + 1))]) if rng.integers(2) else bytes(data)


@pytest.fixture(scope="module")
def memory(demo_folder: Path) -> ObjectMemory:
    path = demo_folder / "site.belief"
    return ObjectMemory.open(path, text_encoder=text_encoder_by_id(ObjectMemory.open(path).text_encoder_id))


def test_every_request_over_zenoh_has_its_row() -> None:
    assert REQUESTS.keys() == {kind.verb for kind in m.REQUESTS}


@pytest.mark.parametrize("kind", m.REQUESTS, ids=lambda kind: kind.verb)
def test_a_spoiled_request_over_zenoh_is_answered_in_json_and_asks_for_nothing(kind, memory: ObjectMemory) -> None:
    operator = SharedOperator()
    server = RemoteServer(operator, memory)
    for payload in [*BROKEN, *spoiled(REQUESTS[kind.verb])]:
        reply = json.loads(json.dumps(server.reply(kind, payload), allow_nan=False))
        assert isinstance(reply["ok"], bool)
        if not reply["ok"]:
            assert reply["refused"] and "\n" not in reply["refused"] and "\x1b" not in reply["refused"], payload[:200]
    assert operator.waiting == (), "nobody who has no lease sends the robot anywhere"


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command["type"])
def test_a_spoiled_command_of_a_page_is_refused_in_one_line(command: dict) -> None:
    operator = SharedOperator()
    commands = Commands(operator, SimpleNamespace(age_s=lambda number: 0.1, painted=lambda number: None))
    page = Page("ada", "operator", id="p")
    for payload in [*BROKEN, *spoiled(command)]:
        said = commands.obey(page, payload.decode("utf-8", "replace"))
        if said is None or said["ok"]:
            continue
        assert said["text"] and "\n" not in said["text"] and "\x1b" not in said["text"], payload[:200]
