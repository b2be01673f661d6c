from __future__ import annotations

import json
from pathlib import Path

import pytest

from openbelief.perception.clip import text_space
from openbelief.perception.model_folder import ModelFolder
from openbelief.perception.sentence import SentenceEncoder
from robot_app.cli import Failure
from robot_app.text_encoders import text_encoder_by_id


@pytest.fixture
def clip_folder(tmp_path: Path, monkeypatch) -> Path:
    """A manifest without its networks, beside one of another kind."""
    monkeypatch.chdir(tmp_path)
    about = {"format": "openbelief.model/1", "architecture": "ViT-none", "precision": "fp32", "files": {}}
    about |= {"weights_sha256": "0" * 64, "dim": 4}
    for kind in ("clip", "sam3"):
        folder = tmp_path / "models" / kind
        folder.mkdir(parents=True)
        (folder / "model.json").write_text(json.dumps(about | {"kind": kind}))
    return tmp_path / "models" / "clip"


def test_the_sentence_encoder_is_always_here():
    assert isinstance(text_encoder_by_id(SentenceEncoder.id), SentenceEncoder)
    assert text_encoder_by_id(SentenceEncoder.id) is text_encoder_by_id(SentenceEncoder.id)


def test_a_clip_is_found_by_its_id_and_what_it_lacks_is_named(clip_folder):
    with pytest.raises(Failure, match=r"model\.json names no file tokenizer\.json"):
        text_encoder_by_id(text_space(ModelFolder(clip_folder, "clip")))


def test_an_encoder_that_is_not_here_is_refused_with_what_is(clip_folder):
    with pytest.raises(
        Failure, match=r"'other==2' is not here; here are 'fast-universal.*', 'clip:ViT-none@000000000000"
    ):
        text_encoder_by_id("other==2")
