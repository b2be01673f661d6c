"""`openbelief ask --audio`: a recording asks as a typed sentence does, and its trial holds what was said and heard."""

from __future__ import annotations

import builtins
import json
from dataclasses import replace
from pathlib import Path

import pytest

from logs.trial.reader import TrialReader
from logs.trial.records import GoalAnswer, Spoken
from openbelief.memory import ObjectMemory
from robot_app.cli import main
from robot_app.text_encoders import text_encoder_by_id
from robot_app.voice.audio import clip_of_wav, read_wav

from .conftest import clip, silence

QUESTION = "May I walk"
SMALL = Path(__file__).parents[1] / "small_scene.json"
HUMAN = Path("/usr/share/pocketsphinx/test/data")
CARD = "seven of clubs"


@pytest.fixture
def config(small_site: Path) -> Path:
    """The demo's robot.toml, with a person's yes before motion."""
    path = small_site / "asking.toml"
    path.write_text((small_site / "robot.toml").read_text().replace('motion = "allow"', 'motion = "ask"'))
    return path


def test_a_recording_becomes_a_confirmed_mission_whose_trial_replays_without_a_recogniser(
    terminal, config, keyboard, screen, capsys, speech, monkeypatch
):
    screen.reactions[QUESTION] = lambda: keyboard.type("yes")
    said = speech / "go_to_the_armchair.wav"
    assert terminal(["ask", "--audio", str(said), "--config", str(config), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["outcome"] == "CONFIRMED" and report["heard"]["transcript"] == "Go to the armchair."
    assert any('Heard "Go to the armchair."' in line for line in screen.lines)

    trial = TrialReader(Path(report["trial"]))
    [entry] = [entry for entry in trial.entries if isinstance(entry.record, Spoken)]
    assert (trial.query.sentence, trial.query.how) == ("Go to the armchair.", "voice")
    assert (entry.record.transcript, entry.record.asked) == ("Go to the armchair.", "Go to the armchair.")
    assert entry.record.confidence == report["heard"]["confidence"] and entry.record.recogniser.startswith("moonshine")
    assert clip_of_wav(entry.attached.wav).seconds == pytest.approx(read_wav(said).seconds)

    whole = builtins.__import__

    def without(name, *arguments, **options):
        if name.startswith("moonshine_voice"):
            raise ImportError(name)
        return whole(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", without)
    assert main(["replay", str(trial.path)]) == 0


def test_the_command_of_the_story_is_heard_and_confirmed(terminal, config, keyboard, screen, capsys, speech):
    screen.reactions[QUESTION] = lambda: keyboard.type("yes")
    said = speech / "take_me_to_the_fire_extinguisher.wav"
    assert terminal(["ask", "--audio", str(said), "--config", str(config), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["outcome"], report["heard"]["transcript"]) == ("CONFIRMED", "Take me to the fire-extinguisher.")


@pytest.fixture
def site_with_a_card(config: Path) -> Path:
    """The bucket of the small room is called what a person says in Debian's recordings of voices."""
    before = config.parent / "site.belief"
    encoder = text_encoder_by_id(ObjectMemory.open(before).text_encoder_id)
    memory = ObjectMemory.open(before, text_encoder=encoder)
    seen = [
        replace(each, phrase=CARD if each.phrase == "bucket" else each.phrase)
        for node in memory.objects
        for each in node.observations
    ]
    ObjectMemory.build(seen, encoder, memory.parameters).save(config.parent / "card.belief")
    scene = config.parent / "card.json"
    scene.write_text(SMALL.read_text().replace('"bucket", "shape"', f'"{CARD}", "shape"'))
    text = config.read_text().replace('"site.belief"', '"card.belief"').replace(str(SMALL), str(scene))
    config.write_text(text)
    return config


@pytest.mark.skipif(not HUMAN.exists(), reason="people's voices: apt-get install pocketsphinx-testdata")
def test_a_recording_of_a_person_becomes_a_confirmed_mission(terminal, site_with_a_card, keyboard, screen, capsys):
    screen.reactions[QUESTION] = lambda: keyboard.type("yes")
    said = HUMAN / "cards" / "003.wav"
    assert terminal(["ask", "--audio", str(said), "--config", str(site_with_a_card), "--json"]) == 0, screen.lines
    report = json.loads(capsys.readouterr().out)
    assert (report["outcome"], report["heard"]["transcript"]) == ("CONFIRMED", "Seven of clubs.")


@pytest.mark.skipif(not HUMAN.exists(), reason="people's voices: apt-get install pocketsphinx-testdata")
def test_what_a_person_says_that_the_map_does_not_hold_drives_nowhere(terminal, config, screen, capsys):
    said = HUMAN / "cards" / "001.wav"
    assert terminal(["ask", "--audio", str(said), "--config", str(config), "--yes", "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert (report["heard"]["transcript"], report["reason"]) == ("Ten of clubs.", "not found"), screen.lines


def test_a_person_at_the_terminal_may_correct_what_was_heard(terminal, config, keyboard, screen, capsys, speech):
    keyboard.terminal = True
    screen.reactions["what you meant"] = lambda: keyboard.type("take me to the armchair please")
    screen.reactions[QUESTION] = lambda: keyboard.type("no")
    status = terminal(["ask", "--audio", str(speech / "go_to_the_armchair.wav"), "--config", str(config), "--json"])
    trial = TrialReader(Path(json.loads(capsys.readouterr().out)["trial"]))
    [spoken] = [record for record in trial.records if isinstance(record, Spoken)]
    assert (status, trial.query.sentence) == (1, "take me to the armchair please")
    assert (spoken.transcript, spoken.asked) == ("Go to the armchair.", "take me to the armchair please")


def test_an_empty_line_at_the_terminal_asks_what_was_heard(terminal, config, keyboard, screen, capsys, speech):
    keyboard.terminal = True
    screen.reactions["what you meant"] = lambda: keyboard.type("")
    screen.reactions[QUESTION] = lambda: keyboard.type("no")
    assert terminal(["ask", "--audio", str(speech / "go_to_the_armchair.wav"), "--config", str(config)]) == 1
    assert any(QUESTION in line for line in screen.lines)


@pytest.mark.parametrize("name", ["stop", "stop_heard_as_step"])
def test_a_recording_that_says_stop_asks_for_nothing(terminal, config, screen, speech, name):
    assert terminal(["ask", "--audio", str(speech / f"{name}.wav"), "--config", str(config), "--yes"]) == 1
    assert "that is a stop, and nothing was asked" in screen.lines[-1]
    trials = [TrialReader(path) for path in (config.parent / "trials").glob("*.mcap")]
    assert not any(isinstance(record, GoalAnswer) for trial in trials for record in trial.records)


def test_silence_and_what_is_no_sound_ask_for_nothing(terminal, config, screen, tmp_path):
    quiet, text = tmp_path / "quiet.wav", tmp_path / "text.wav"
    quiet.write_bytes(clip(silence(2.0)).wav())
    text.write_text("take me to the armchair")
    for path, because in ((quiet, "nothing was said"), (text, "no PCM WAV file"), (tmp_path / "no.wav", "cannot be")):
        assert terminal(["ask", "--audio", str(path), "--config", str(config), "--yes"]) == 1
        assert because in screen.lines[-1]


def test_an_unknown_recogniser_in_robot_toml_is_refused_before_the_robot_is_opened(terminal, config, screen, speech):
    config.write_text(config.read_text().replace('"moonshine"', '"sherpa:whisper:models/de"'))
    assert terminal(["ask", "--audio", str(speech / "stop.wav"), "--config", str(config)]) == 1
    assert f"there is no folder {config.parent / 'models/de'}" in screen.lines[-1]


REFUSED = {
    "a recogniser that there is not": (('"moonshine"', '"nonsense"'), None, "no recogniser 'nonsense'"),
    "a language that the model does not know": (('language = "en"', 'language = "de"'), None, "English alone"),
    "the extra is not installed": (("", ""), "moonshine_voice", "requirements/voice.txt"),
}


@pytest.mark.parametrize(("change", "missing", "because"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_listen_is_refused_in_one_line_and_nothing_is_recorded(
    terminal, config, screen, speech, monkeypatch, change, missing, because
):
    config.write_text(config.read_text().replace(*change))
    before = sorted(config.parent.glob("*.mcap"))
    whole = builtins.__import__

    def without(name, *arguments, **options):
        if name.split(".")[0] == missing:
            raise ImportError(name)
        return whole(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", without)
    assert terminal(["ask", "--audio", str(speech / "yes.wav"), "--config", str(config), "--yes"]) == 1
    assert because in screen.lines[-1] and sorted(config.parent.glob("*.mcap")) == before


def test_a_recording_that_is_too_long_is_refused(terminal, config, screen, tmp_path):
    (tmp_path / "long.wav").write_bytes(clip(silence(31.0)).wav())
    assert terminal(["ask", "--audio", str(tmp_path / "long.wav"), "--config", str(config), "--yes"]) == 1
    assert "30 s is the limit" in screen.lines[-1]


@pytest.mark.parametrize("words", [[], ["go to the armchair", "--audio", "said.wav"]])
def test_a_sentence_and_a_recording_are_one_or_the_other(terminal, config, words):
    with pytest.raises(SystemExit, match="2"):
        terminal(["ask", *words, "--config", str(config)])
