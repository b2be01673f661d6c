"""The page's talk button: what is said is heard, shown and asked like typed words; a stop stops at once."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from logs.trial.records import Spoken
from robot_app.config_sections import VoiceSection
from robot_app.console.talk import Talk
from robot_app.voice import spoken_stop
from robot_app.voice.audio import read_wav
from robot_app.voice.listener import Listener
from tests.robot_app.voice.conftest import ScriptedRecogniser
from tests.support.waiting import until

SPEECH = Path(__file__).parents[1] / "voice" / "speech"
CHROMIUM = shutil.which("chromium")
CHUNK = 4096


def talk(socket: ClientConnection, sound: bytes) -> dict[str, Any]:
    for at in range(0, len(sound), CHUNK):
        socket.send(sound[at : at + CHUNK])
    socket.send("end")
    return json.loads(socket.recv(60.0))


def said(name: str) -> bytes:
    return read_wav(SPEECH / f"{name}.wav").pcm16()


def test_what_was_said_is_heard_and_its_sound_goes_with_the_sentence_that_is_asked(console, pages):
    visitor = console.visitor()
    with visitor.socket("/ws/voice") as voice:
        heard = talk(voice, said("go_to_the_armchair"))
    assert (heard["type"], heard["transcript"], heard["stop"]) == ("heard", "Go to the armchair.", None)
    with visitor.socket("/ws?page=b") as socket:
        mine = pages(socket)
        assert mine.command(type="take", over=False)["ok"]
        epoch = mine.next_state()["you"]["epoch"]
        asked = mine.command(type="ask", epoch=epoch, text="go to the red armchair", heard=heard["heard"])
        assert asked["ok"]
    [sentence] = console.operator.waiting
    [note] = sentence.notes
    assert (note.record.transcript, note.record.asked) == ("Go to the armchair.", "go to the red armchair")
    assert isinstance(note.record, Spoken) and note.attached.wav[:4] == b"RIFF"


@pytest.mark.parametrize("name", ["stop", "stop_heard_as_step"])
def test_a_spoken_stop_stops_without_the_command_and_is_kept_in_the_trial_under_way(console, name):
    with console.visitor().socket("/ws/voice") as voice:
        assert talk(voice, said(name))["stop"]
    because = console.operator.stop_requested().because
    assert because.startswith("ada spoke: ") and "emergency" not in because
    [note] = console.kept
    assert note.record.asked == "stop"


STOPS = sorted(spoken_stop.WORDS | spoken_stop.NEAR_MISSES)


@pytest.mark.parametrize("words", [*STOPS, "please stop", "stop stop stop", "halt now", "hey step", "it's top"])
def test_each_stop_and_each_near_miss_stops_alone_or_with_a_word_beside_it(console, words):
    listener = Listener(ScriptedRecogniser(words))
    talk = Talk(VoiceSection(), tuple, console.operator, console.kept.append, listener=listener)
    assert talk.understood(said("stop"), "ada")["stop"] in words
    assert console.operator.stop_requested().who == "ada" and console.kept[0].record.transcript == words


@pytest.mark.parametrize("words", ["step ladder", "stock pot", "red chair", "the top shelf", "yes", "no"])
def test_what_is_no_stop_stops_nothing(console, words):
    talk = Talk(
        VoiceSection(), tuple, console.operator, console.kept.append, listener=Listener(ScriptedRecogniser(words))
    )
    assert talk.understood(said("yes"), "ada")["stop"] is None
    assert console.operator.stop_requested() is None and console.kept == []


def test_one_socket_serves_one_utterance_after_the_other(console):
    with console.visitor().socket("/ws/voice") as voice:
        assert [talk(voice, said("yes"))["transcript"] for _ in range(2)] == ["Yes.", "Yes."]


@pytest.mark.parametrize(
    ("sound", "because"),
    [(b"", "is empty"), (bytes(32_000), "nothing was said"), (bytes(2 * 16_000 * 31), "30 s"), (b"\0" * 9, "middle")],
)
def test_silence_nothing_and_too_much_are_refused_in_one_line(console, sound, because):
    with console.visitor().socket("/ws/voice") as voice:
        answer = talk(voice, sound)
    assert answer["type"] == "refused" and because in answer["text"]


def test_a_viewer_is_refused_and_who_is_not_logged_in_gets_nothing(console):
    with console.visitor("viewer", "vic").socket("/ws/voice") as voice:
        assert talk(voice, said("stop")) == {"type": "refused", "text": "You are a viewer: you may look, and STOP."}
    assert console.operator.stop_requested() is None
    with console.visitor(None).socket("/ws/voice") as voice, pytest.raises(ConnectionClosed):
        voice.recv(20.0)


def test_what_somebody_else_said_is_not_mine_to_ask_with(console, pages):
    with console.visitor().socket("/ws/voice") as voice:
        heard = talk(voice, said("yes"))["heard"]
    visitor = console.visitor(name="eve")
    with visitor.socket("/ws?page=e") as socket:
        eve = pages(socket)
        assert eve.command(type="take", over=False)["ok"]
        assert eve.command(type="ask", epoch=eve.next_state()["you"]["epoch"], text="go to the sofa", heard=heard)["ok"]
    assert console.operator.waiting[0].notes == ()


@pytest.fixture
def browser() -> Iterator[Any]:
    """Chromium with a microphone into which the recorded sentence is spoken, over and over."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("chromium is not installed (apt-get install chromium)")
    arguments = [
        "--no-sandbox",
        "--use-fake-device-for-media-stream",
        "--use-fake-ui-for-media-stream",
        f"--use-file-for-fake-audio-capture={SPEECH / 'go_to_the_armchair.wav'}",
    ]
    with api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield chromium
        chromium.close()


def test_held_in_a_browser_the_button_fills_the_ask_line_with_what_the_microphone_heard(console, browser):
    page = browser.new_page()
    page.goto(console.server.pairing_url("ada", "operator"))
    button = page.locator("#talk")
    button.wait_for(state="visible")
    said: list[str] = []
    box = button.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.wait_for_timeout(3500)  # somebody speaks for as long as that takes
    page.mouse.up()

    def heard() -> bool:
        said.append(page.locator("#ask-words").input_value())
        return "armchair" in said[-1].lower().replace("-", "")

    until(heard, "the transcript in the ask line")
    assert page.locator("#ask-answer").inner_text().startswith("Heard with confidence")
