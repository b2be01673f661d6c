"""The robot's sentences as sound for a page: the newest alone, for who is logged in, and none while a page listens."""

from __future__ import annotations

import pytest

from robot_app.config_sections import VoiceSection
from robot_app.console import speech as page_speech
from robot_app.console.speech import KEPT, PageVoice
from robot_app.voice.audio import clip_of_wav
from robot_app.voice.synthetic import installed
from tests.support.waiting import until

needs_espeak = pytest.mark.skipif(not installed("espeak-ng"), reason="espeak-ng is not installed (apt-get install)")


@needs_espeak
def test_what_is_said_is_in_the_snapshot_and_its_sound_is_given_to_who_is_logged_in(console, page):
    console.operator.tell("I walk to the sofa.")
    until(lambda: page.next_state()["speech"]["said"], "the page knows it")
    speech = page.state["speech"]
    assert (speech["said"], speech["sound"]) == ([{"n": 1, "words": "I walk to the sofa."}], True)
    path = "/api/speech/1.wav"
    status, body, headers = console.visitor("viewer", "vic").get(path)
    assert (status, headers["content-type"]) == (200, "audio/wav") and 0.5 < clip_of_wav(body).seconds < 4.0
    assert console.visitor(None).get(path)[0] == 401


def words(console) -> list[str]:
    return [each["words"] for each in console.voice.as_json()["said"]]


def test_what_is_no_news_any_more_is_not_given_and_a_stop_is_alone(console):
    for number in range(KEPT + 1):
        console.operator.tell(f"Number {number}.")
    assert words(console) == [f"Number {number}." for number in range(1, KEPT + 1)]
    assert console.visitor().get("/api/speech/1.wav")[0] == 404
    console.operator.stop(because="ada pressed STOP")
    assert words(console) == ["Stop: ada pressed STOP."]


def test_while_an_operators_page_listens_every_page_is_silent(console, page):
    console.operator.tell("One.")
    until(lambda: page.next_state()["speech"]["said"], "the page knows it")
    with console.visitor().socket("/ws/voice") as socket:
        socket.send(bytes(3200))
        until(lambda: page.next_state()["speech"]["said"] == [], "silence")
        console.operator.tell("Two.")
        assert words(console) == []
    until(lambda: (console.operator.tell("Three."), words(console))[1], "its end")
    assert set(words(console)) == {"Three."}


def test_a_viewers_microphone_silences_nobody(console):
    console.operator.tell("One.")
    with console.visitor("viewer", "vic").socket("/ws/voice") as socket:
        socket.send(bytes(3200))
        socket.send("end")
        socket.recv(20.0)
        assert words(console) == ["One."]


def test_without_espeak_the_page_is_told_to_use_a_voice_of_its_own(monkeypatch):
    monkeypatch.setattr(page_speech, "installed", lambda program: False)
    assert PageVoice(VoiceSection()).as_json()["sound"] is False


def test_a_language_that_espeak_does_not_know_is_said_to_the_page(console, monkeypatch):
    monkeypatch.setattr(console.voice, "_language", "zz-nowhere")
    console.operator.tell("One.")
    status, body, _ = console.visitor().get(f"/api/speech/{console.voice.as_json()['n']}.wav")
    assert status == 503 and b"espeak-ng" in body
