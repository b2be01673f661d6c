"""`openbelief bench voice` counts what was said, heard and invented."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from robot_app.benches import speech
from robot_app.cli import main
from robot_app.voice.audio import read_wav

SPEECH = Path(__file__).parents[1] / "voice" / "speech"


@pytest.fixture
def recordings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Laid out as Debian's pocketsphinx-testdata: two utterances, one of them said to be a word longer than it is."""
    (tmp_path / "cards").mkdir()
    shutil.copy(SPEECH / "go_to_the_armchair.wav", tmp_path / "cards" / "001.wav")
    shutil.copy(SPEECH / "yes.wav", tmp_path / "cards" / "002.wav")
    (tmp_path / "cards" / "cards.transcription").write_text(
        "<s> go to the red armchair  </s> (001)\n<s> yes </s> (002)\n"
    )
    monkeypatch.setattr(speech, "installed", lambda _: False)
    return tmp_path


def test_words_wrong_are_counted_against_the_transcripts(recordings, capsys):
    assert main(["bench", "voice", "--human", str(recordings), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)["sets"]["human"]
    assert result["words"] == {"utterances": 2, "words": 6, "wrong": 1}
    assert (result["nothing_heard"], result["short"], result["invented"]) == (0, 1, [])
    assert 0 < result["seconds"]["median"] <= result["seconds"]["worst"]


def test_a_stop_that_nobody_said_is_named(recordings, tmp_path, capsys):
    said = tmp_path / "no-stop"
    said.mkdir()
    shutil.copy(SPEECH / "stop.wav", said / "surprise.wav")
    assert main(["bench", "voice", "--human", str(recordings), "--no-stop", str(said)]) == 0
    assert "stops invented: 1 of 1, 1 heard as one or two words; surprise.wav: Stop." in capsys.readouterr().out


def test_without_anything_to_listen_to_it_says_what_to_install(recordings, tmp_path, capsys):
    assert main(["bench", "voice", "--human", str(tmp_path / "none")]) == 1
    assert "apt-get install pocketsphinx-testdata espeak-ng flite" in capsys.readouterr().err


@pytest.mark.skipif(not speech.installed("espeak-ng"), reason="espeak-ng is not installed (apt-get install espeak-ng)")
def test_noise_is_laid_over_the_voice_as_loud_as_it_says():
    import numpy as np

    clean = speech.spoken("stop", "espeak-ng", "en-us")
    noisy = speech._noisy(speech.in_a_pause(clean), 10.0, np.random.default_rng(0))
    voice = float(np.sqrt(np.mean(np.square(clean.samples[clean.samples != 0]))))
    assert 20 * np.log10(voice / noisy.samples[:4000].std()) == pytest.approx(10.0, abs=0.5)


@pytest.mark.skipif(not speech.HUMAN.is_dir(), reason="pocketsphinx-testdata is not installed")
def test_debians_human_recordings_are_found_with_their_words():
    said = list(speech.human(speech.HUMAN))
    assert len(said) == 14 and sum(each.words is not None for each in said) == 12
    assert all(0.5 < each.clip.seconds < 10 for each in said)
    assert read_wav(speech.HUMAN / "cards/001.wav").seconds == pytest.approx(1.095, abs=0.01)
