"""The recognisers that the extra brings, on real (synthetic) speech; and each way in which there is none."""

from __future__ import annotations

import base64
import builtins
from pathlib import Path

import pytest

from robot_app.cli import Failure
from robot_app.voice.audio import read_wav
from robot_app.voice.listener import Listener
from robot_app.voice.recogniser import Recogniser
from robot_app.voice.recognisers import open_recogniser
from robot_app.voice.sherpa import confidence_of


@pytest.fixture(scope="module")
def moonshine() -> Recogniser:
    return open_recogniser("moonshine")


def test_the_model_in_the_wheel_understands_a_command(moonshine, speech):
    heard = Listener(moonshine).understand(read_wav(speech / "go_to_the_armchair.wav"))
    assert heard.transcript == "Go to the armchair." and 0 < heard.confidence <= 1
    assert heard.recogniser.startswith("moonshine-voice 0.0.73") and heard.language == "en"


@pytest.mark.parametrize(("name", "near_miss"), [("stop", False), ("stop_heard_as_step", True)])
def test_a_stop_is_heard_also_where_the_model_makes_another_word_of_it(moonshine, speech, name, near_miss):
    heard = Listener(moonshine).understand(read_wav(speech / f"{name}.wav"))
    assert heard.stop is not None and heard.stop.near_miss == near_miss


def test_a_model_brought_by_path_understands_the_same(speech, tmp_path):
    folder = model_for_sherpa(tmp_path / "tiny")
    made = open_recogniser(f"sherpa:moonshine:{folder}", "en")
    heard = Listener(made).understand(read_wav(speech / "go_to_the_armchair.wav"))
    assert heard.transcript == "Go to the armchair." and heard.confidence is None
    assert heard.recogniser == "sherpa-onnx moonshine tiny"


def model_for_sherpa(folder: Path) -> Path:
    """The model of the wheel as sherpa-onnx wants it: its tokens as text."""
    import moonshine_voice

    assets = Path(moonshine_voice.__file__).parent / "assets" / "tiny-en"
    folder.mkdir()
    for name in ("encoder_model.ort", "decoder_model_merged.ort"):
        (folder / name).symlink_to(assets / name)
    tokens, data, at = [], (assets / "tokenizer.bin").read_bytes(), 0
    while at < len(data):
        size, at = data[at], at + 1
        if size >= 128:
            size, at = data[at] * 128 + size - 128, at + 1
        tokens.append(base64.b64encode(data[at : at + size]).decode())
        at += size
    (folder / "tokens.txt").write_text("".join(f"{token} {number}\n" for number, token in enumerate(tokens)))
    return folder


@pytest.mark.parametrize(
    ("spec", "language", "because"),
    [
        ("whisper", "en", "no recogniser 'whisper'"),
        ("moonshine:/models", "en", "takes no argument"),
        ("moonshine", "de", "knows English alone"),
        ("sherpa", "de", "names no model"),
        ("sherpa:nonsense:/models", "de", "names no model"),
        ("sherpa:whisper:/no/such/folder", "de", "no folder /no/such/folder"),
    ],
)
def test_a_recogniser_that_there_is_not_is_refused_in_one_line(spec, language, because):
    with pytest.raises(Failure, match=because) as refused:
        open_recogniser(spec, language)
    assert "\n" not in str(refused.value)


def test_a_folder_without_a_model_says_which_file_is_missing(tmp_path):
    (tmp_path / "tiny-encoder.onnx").touch()
    with pytest.raises(Failure, match=r"holds no \*decoder\*\.onnx"):
        open_recogniser(f"sherpa:whisper:{tmp_path}", "de")


@pytest.mark.parametrize("spec", ["moonshine", "sherpa:moonshine:{folder}"])
def test_without_the_extra_one_line_says_how_to_add_it(monkeypatch, tmp_path, spec):
    folder = model_for_sherpa(tmp_path / "tiny")
    whole = builtins.__import__

    def without(name, *arguments, **options):
        if name.split(".")[0] in ("moonshine_voice", "sherpa_onnx"):
            raise ImportError(name)
        return whole(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(Failure, match=r"requirements/voice\.txt"):
        open_recogniser(spec.format(folder=folder))


def test_confidence_is_the_tokens_mean_probability_and_unknown_without():
    assert confidence_of([]) is None
    assert confidence_of([-0.5, -1.5]) == pytest.approx(0.3679, abs=1e-4)
