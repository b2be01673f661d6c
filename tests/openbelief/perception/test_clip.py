"""Promises of the CLIP adapter, on a tiny open_clip network with what open_clip itself made of the same inputs.

The fixture is written by scripts/export/fixtures.py; the real architectures are compared by `make parity`.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from openbelief.belief import synonym_threshold
from openbelief.parameters import Parameters
from openbelief.perception.clip import IMAGE_BATCH, Clip
from openbelief.perception.model_folder import ModelFolderError
from openbelief.perception.ports import ImageEncoder, TextEncoder
from openbelief.perception.prompt_tokens import PromptTokens

FIXTURE = Path(__file__).parent / "fixtures" / "clip"
HALF = FIXTURE.with_name("clip-fp16")  # the same weights in half precision


@pytest.fixture(scope="module")
def clip() -> Clip:
    return Clip(FIXTURE, device="cpu")


@pytest.fixture(scope="module")
def expected() -> dict[str, np.ndarray]:
    return dict(np.load(FIXTURE / "expected.npz"))


@pytest.fixture(scope="module")
def photos(expected) -> list[np.ndarray]:
    return [expected[f"photo_{i}"] for i in range(3)]


def test_photographs_become_the_rows_that_open_clip_makes(clip, expected, photos):
    np.testing.assert_allclose(clip.images.encode(photos), expected["images"], atol=1e-5)


def test_half_precision_stays_near_open_clip_for_pictures_and_texts(clip, expected, photos):
    half = Clip(HALF, device="cpu")
    prompts = [str(text) for text in expected["prompts"]]
    for got, single, want in (
        (half.images.encode(photos), clip.images.encode(photos), expected["images"]),
        (half.text.encode(prompts), clip.text.encode(prompts), expected["prompt_rows"]),
    ):
        np.testing.assert_allclose(got, want, atol=3e-3)
        assert (got * want).sum(axis=1).min() > 0.9999
        assert np.abs(got - single).max() > 1e-5, "it is not in half precision"


def test_half_precision_gives_the_same_rows_again_and_in_a_batch(photos):
    half = Clip(HALF, device="cpu").images
    first = half.encode(photos)
    np.testing.assert_array_equal(half.encode(photos), first)
    np.testing.assert_allclose(half.encode(photos * IMAGE_BATCH)[-3:], first, atol=3e-3)


def test_a_memory_of_one_precision_is_not_asked_in_the_other(clip):
    half = Clip(HALF, device="cpu")
    assert half.text.id == clip.text.id.replace("-fp32", "-fp16") != clip.text.id


def test_wide_tall_and_small_photographs_are_resized_and_cut_as_open_clip_does(clip, expected, photos):
    for photo, pixels in zip(photos, expected["pixels"], strict=True):
        np.testing.assert_allclose(clip.images._transform(photo), pixels, atol=1e-5)


def test_a_text_is_the_normalised_mean_of_both_templates(clip, expected):
    rows = clip.text.encode([str(text) for text in expected["prompts"]])
    np.testing.assert_allclose(rows, expected["prompt_rows"], atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(rows, axis=1), 1.0, atol=1e-6)


def test_texts_in_any_script_get_the_token_ids_that_open_clip_gives(expected):
    ids, _ = PromptTokens(FIXTURE / "tokenizer.json", "lower")([str(text) for text in expected["texts"]])
    assert len(ids) > 100
    np.testing.assert_array_equal(ids, expected["ids"])


def test_words_that_spell_a_special_token_stay_words(clip):
    ids, mask = clip.text._tokens(["a <end_of_text> b"])
    end = clip.text._tokens._tokenizer.token_to_id("<end_of_text>")
    assert (ids[0] == end).sum() == 1 and ids[0][mask[0].sum() - 1] == end


def test_both_encoders_say_that_they_share_a_space(clip):
    assert isinstance(clip.text, TextEncoder) and isinstance(clip.images, ImageEncoder)
    assert clip.images.text_space == clip.text.id
    assert clip.images.encode([]).shape == (0, clip.text.dim) == clip.text.encode([]).shape


def test_the_text_encoders_id_names_architecture_weights_and_templates(clip):
    assert clip.text.id.startswith("clip:small-random@")
    assert "There is the {} in the scene." in clip.text.id


def test_clip_text_takes_its_own_synonym_threshold(clip):
    assert synonym_threshold(Parameters(), clip.text.id) == 0.90
    assert synonym_threshold(Parameters(synonym_threshold=0.7), clip.text.id) == 0.7


def test_a_picture_gets_the_same_row_alone_and_in_a_batch(clip, photos):
    many = clip.images.encode(photos * IMAGE_BATCH)
    np.testing.assert_allclose(many[-3:], clip.images.encode(photos), atol=1e-6)


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda folder: (folder / "text.onnx").unlink(), r"text\.onnx is missing"),
        (lambda folder: (folder / "image.onnx").write_bytes(b"short"), r"image\.onnx has 5 bytes instead of"),
        (lambda folder: _flip_a_byte(folder / "text.onnx"), r"text\.onnx is not the file that was exported"),
        (lambda folder: (folder / "tokenizer.json").unlink(), r"tokenizer\.json is missing"),
        (lambda folder: (folder / "model.json").unlink(), r"model\.json is missing: make the folder with"),
        (lambda folder: (folder / "model.json").write_text("{"), r"model\.json cannot be read"),
        (lambda folder: (folder / "model.json").write_text("{}"), r"model\.json should say .*'clip'"),
    ],
)
def test_a_missing_truncated_or_changed_file_is_refused_by_name(tmp_path, damage, words):
    folder = Path(shutil.copytree(FIXTURE, tmp_path / "clip"))
    damage(folder)
    with pytest.raises(ModelFolderError, match=words):
        opened = Clip(folder, device="cpu")
        _ = opened.text, opened.images


def _flip_a_byte(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


@pytest.mark.parametrize(
    ("device", "words"), [("tensorrt", "this onnxruntime has"), ("tpu", "auto or one of cpu, cuda")]
)
def test_a_device_that_is_not_there_is_refused_instead_of_falling_back(device, words):
    with pytest.raises(ModelFolderError, match=words):
        _ = Clip(FIXTURE, device=device).text
