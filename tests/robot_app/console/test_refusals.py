"""Each refusal, by page, talk button and Zenoh, while a question is open: one sentence for a screen, no effect."""

from __future__ import annotations

import builtins
import json
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from drivers.ports import Question
from robot_app.config_sections import VoiceSection
from robot_app.console.talk import Talk
from robot_app.remote import messages as m
from robot_app.remote.server import RemoteServer
from robot_app.voice.audio import MAX_S, RATE_HZ, read_wav
from tests.support.waiting import until

SPEECH = Path(__file__).parents[1] / "voice" / "speech"
TOO_LONG = bytes(2 * round((MAX_S + 1) * RATE_HZ))
WORDS = "find the lamp"


class Everybody:
    """A console with an operator's page that commands, a question that is open, and everybody who may try something."""

    def __init__(self, console: Any, pages: type, monkeypatch: pytest.MonkeyPatch, memory: Any) -> None:
        self.console, self._pages, self.monkeypatch = console, pages, monkeypatch
        self.server = RemoteServer(console.operator, memory)
        lease = self.server.reply(m.LeaseRequest, b'{"who": "eve"}')  # ada takes over from her
        self.token = {"token": lease["token"], "epoch": lease["epoch"]}

    def page(self, role: str = "operator", name: str = "bob", **command: Any) -> str:
        """What that person's page is answered."""
        with self.console.visitor(role, name).socket("/ws?page=other") as socket:
            refused = self._pages(socket).command(**command)
        assert not refused["ok"]
        return str(refused["text"])

    def talk(self, sound: bytes, role: str = "operator") -> str:
        with self.console.visitor(role, "bob").socket("/ws/voice") as socket:
            for at in range(0, len(sound), 8192):
                socket.send(sound[at : at + 8192])
            socket.send("end")
            answer = json.loads(socket.recv(60.0))
        assert answer["type"] == "refused", answer
        return str(answer["text"])

    def talk_with(self, voice: VoiceSection) -> str:
        answer = Talk(voice, tuple, self.console.operator, self.console.kept.append).understood(said(), "ada")
        assert answer["type"] == "refused", answer
        return str(answer["text"])

    def zenoh(self, kind: type[m.RemoteMessage], **values: Any) -> str:
        reply = self.server.reply(kind, json.dumps(values).encode())
        assert not reply["ok"]
        return str(reply["refused"])

    def without(self, name: str) -> None:
        whole = builtins.__import__

        def imported(module: str, *arguments: Any, **options: Any) -> Any:
            if module.split(".")[0] == name:
                raise ImportError(name)
            return whole(module, *arguments, **options)

        self.monkeypatch.setattr(builtins, "__import__", imported)

    def effect(self) -> tuple[Any, ...]:
        """Whatever a command could change."""
        operator, asked = self.console.operator, self.console.operator.question
        return (
            operator.lease,
            operator.waiting,
            asked,
            asked and asked.reply,
            operator.stop_requested(),
            self.console.kept[:],
        )


def said() -> bytes:
    return read_wav(SPEECH / "stop.wav").pcm16()  # what is refused to be heard stops nothing either


def talk_without_the_extra(at: Everybody) -> str:
    at.without("moonshine_voice")
    return at.talk_with(VoiceSection())


def answer(at: Everybody, **more: Any) -> dict[str, Any]:
    return {"question": at.console.operator.question.id, "memory_hash": "abc", "word": "yes", **more}


REFUSALS: dict[str, tuple[Callable[[Everybody], str], str]] = {
    "a viewer asks": (lambda at: at.page("viewer", type="ask", epoch=1, text=WORDS), "You are a viewer"),
    "a viewer takes the command": (lambda at: at.page("viewer", type="take", over=True), "You are a viewer"),
    "a viewer answers": (lambda at: at.page("viewer", type="answer", epoch=1, **answer(at)), "You are a viewer"),
    "a viewer speaks": (lambda at: at.talk(said(), "viewer"), "You are a viewer"),
    "a page without the command asks": (lambda at: at.page(type="ask", epoch=0, text=WORDS), "commands the robot now"),
    "a page without the command answers": (
        lambda at: at.page(type="answer", epoch=1, **answer(at)),
        "commands the robot now",
    ),
    "a page takes what somebody has": (lambda at: at.page(type="take", over=False), "take over first"),
    "too much is said": (lambda at: at.talk(TOO_LONG), "30 s is the limit"),
    "half a sample is said": (lambda at: at.talk(b"\0" * 9), "middle of a sample"),
    "nothing is said": (lambda at: at.talk(bytes(32_000)), "nothing was said"),
    "no such recogniser": (lambda at: at.talk_with(VoiceSection(recogniser="nonsense")), "no recogniser 'nonsense'"),
    "no such model": (
        lambda at: at.talk_with(VoiceSection(recogniser="sherpa:whisper:/no/such")),
        "no folder /no/such",
    ),
    "a language that the model does not know": (lambda at: at.talk_with(VoiceSection(language="de")), "English alone"),
    "the extra is not installed": (talk_without_the_extra, "requirements/voice.txt"),
    "a program without a lease asks": (
        lambda at: at.zenoh(m.AskRequest, sentence=WORDS, token="", epoch=0),
        "commands the robot",
    ),
    "a program with a guessed token asks": (
        lambda at: at.zenoh(m.AskRequest, sentence=WORDS, **{**at.token, "token": "guessed"}),
        "commands the robot",
    ),
    "a program with the token of before the takeover asks": (
        lambda at: at.zenoh(m.AskRequest, sentence=WORDS, **at.token),
        "commands the robot",
    ),
    "a program with the token of before the takeover says yes": (
        lambda at: at.zenoh(m.ConfirmRequest, **answer(at), **at.token),
        "commands the robot",
    ),
    "a program takes what somebody has": (lambda at: at.zenoh(m.LeaseRequest, who="bob"), "take over first"),
    "a request is too large": (
        lambda at: at.zenoh(m.ProposeRequest, agent="helper", sentence="x" * (m.REQUEST_MAX_BYTES + 1)),
        "KiB is the limit",
    ),
    "an agent says too much": (
        lambda at: at.zenoh(m.ProposeRequest, agent="helper", sentence="x" * 301),
        "sentence: String should have at most 300",
    ),
    "an agent names nothing": (lambda at: at.zenoh(m.ProposeRequest, agent="helper", sentence="???"), "names nothing"),
}


@pytest.fixture
def everybody(console, pages, monkeypatch, small_room) -> Iterator[Everybody]:
    at = Everybody(console, pages, monkeypatch, small_room.memory)
    console.operator.take("ada", "console", over=True)
    asking = threading.Thread(target=console.operator.confirm, args=(Question("May I?", memory_hash="abc"), 60.0))
    asking.start()
    until(lambda: console.operator.question is not None, "the question")
    yield at
    console.operator.stop(because="the test is over")
    asking.join(20.0)


@pytest.mark.parametrize(("tried", "because"), REFUSALS.values(), ids=REFUSALS)
def test_what_is_refused_is_said_in_one_line_and_changes_nothing(everybody, tried, because):
    before = everybody.effect()
    sentence = tried(everybody)
    assert because in sentence and "\n" not in sentence
    assert everybody.effect() == before


def test_an_agents_proposal_is_refused_where_nobody_commands(console, small_room):
    server = RemoteServer(console.operator, small_room.memory)
    reply = server.reply(m.ProposeRequest, json.dumps({"agent": "helper", "sentence": WORDS}).encode())
    assert "a person must be there" in reply["refused"] and console.operator.waiting == ()
