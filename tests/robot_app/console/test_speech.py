"""The robot's sentences as sound for a page: the newest alone, for who is logged in, and none while a page listens."""

from __future__ import annotations

import pytest

from robot_app.config import VoiceSection
from robot_app.console import speech
from robot_app.console.speech import PageVoice
from robot_app.voice.audio import clip_of_wav
from robot_app.voice.synthetic import installed
from tests.support.waiting import until

needs_espeak = pytest.mark.skipif(not installed("espeak-ng"), reason="espeak-ng is not installed (apt-get install)")


@needs_espeak
def test_what_is_said_is_in_the_snapshot_and_its_sound_is_given_to_who_is_logged_in(console, page):
    console.operator.tell("I walk to the sofa.")
    said = page.next_state()["speech"]
    assert (said["words"], said["sound"]) == ("I walk to the sofa.", True)
    path = f"/api/speech/{said['n']}.wav"
    status, body, headers = console.visitor("viewer", "vic").get(path)
    assert (status, headers["content-type"]) == (200, "audio/wav") and 0.5 < clip_of_wav(body).seconds < 4.0
    assert console.visitor(None).get(path)[0] == 401


def test_an_older_sentence_is_not_given_any_more(console):
    console.operator.tell("One.")
    number = console.voice.as_json()["n"]
    console.operator.tell("Two.")
    assert console.visitor().get(f"/api/speech/{number}.wav")[0] == 404


def test_while_an_operators_page_listens_every_page_is_silent(console, page):
    console.operator.tell("One.")
    with console.visitor().socket("/ws/voice") as socket:
        socket.send(bytes(3200))
        until(lambda: page.next_state()["speech"]["words"] == "", "silence")
        console.operator.tell("Two.")
        assert console.voice.as_json()["words"] == ""
    until(lambda: (console.operator.tell("Three."), console.voice.as_json()["words"])[1] == "Three.", "its end")


def test_a_viewers_microphone_silences_nobody(console):
    console.operator.tell("One.")
    with console.visitor("viewer", "vic").socket("/ws/voice") as socket:
        socket.send(bytes(3200))
        socket.send("end")
        socket.recv(20.0)
        assert console.voice.as_json()["words"] == "One."


def test_without_espeak_the_page_is_told_to_use_a_voice_of_its_own(monkeypatch):
    monkeypatch.setattr(speech, "installed", lambda program: False)
    assert PageVoice(VoiceSection()).as_json()["sound"] is False


def test_a_language_that_espeak_does_not_know_is_said_to_the_page(console, monkeypatch):
    monkeypatch.setattr(console.voice, "_language", "zz-nowhere")
    console.operator.tell("One.")
    status, body, _ = console.visitor().get(f"/api/speech/{console.voice.as_json()['n']}.wav")
    assert status == 503 and b"espeak-ng" in body
