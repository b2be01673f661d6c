"""Promises of the SAM 3 adapter, on a tiny SAM 3 with what transformers' own classes made of the same inputs.

The fixture is written by scripts/export/fixtures.py; `make parity` compares more photographs, texts and steps.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.perception.model_folder import ModelFolderError
from openbelief.perception.ports import Segmenter
from openbelief.perception.sam3 import PROMPTS_AT_ONCE, SCORE_THRESHOLD, Sam3Segmenter, instances

FIXTURE = Path(__file__).parent / "fixtures" / "sam3"
PHOTOS = (0, 1, 2)


@pytest.fixture(scope="module")
def sam3() -> Sam3Segmenter:
    return Sam3Segmenter(FIXTURE, device="cpu")


@pytest.fixture(scope="module")
def expected() -> dict[str, np.ndarray]:
    return dict(np.load(FIXTURE / "expected.npz"))


@pytest.fixture(scope="module")
def prompts(expected) -> list[str]:
    return [str(prompt) for prompt in expected["prompts"]]


@pytest.fixture
def frame() -> Callable[[np.ndarray], RgbdFrame]:
    def make(color: np.ndarray) -> RgbdFrame:
        height, width = color.shape[:2]
        camera = Intrinsics(width, height, 100.0, 100.0, width / 2, height / 2)
        return RgbdFrame(0, 0, color, np.zeros((height, width), np.float32), camera, np.eye(4))

    return make


@pytest.mark.parametrize("photo", PHOTOS)
def test_a_photograph_is_prepared_within_one_grey_level_of_the_reference(sam3, expected, photo):
    levels = 255 * (sam3._transform(expected[f"photo_{photo}"]) + 1) / 2
    assert np.abs(levels - expected[f"levels_{photo}"]).max() <= 1.01


@pytest.mark.parametrize("photo", PHOTOS)
def test_scores_boxes_and_masks_are_the_references_own(sam3, expected, prompts, photo):
    found = sam3.instances(expected[f"photo_{photo}"], prompts)
    assert [p for p, several in enumerate(found) for _ in several] == expected[f"prompt_{photo}"].tolist()
    flat = [one for several in found for one in several]
    assert flat, "the fixture shows nothing where nothing is found"
    np.testing.assert_allclose([one.score for one in flat], expected[f"scores_{photo}"], atol=1e-3)
    np.testing.assert_allclose([one.box for one in flat], expected[f"boxes_{photo}"], atol=0.1)
    assert (
        np.stack([one.pixels for one in flat]) != expected[f"masks_{photo}"]
    ).mean() < 5e-3  # a grey level more or less


def test_prompts_get_the_references_token_ids_and_a_long_one_is_cut(sam3, expected, prompts):
    np.testing.assert_array_equal(sam3._tokens(prompts)[0], expected["ids_0"])
    ids, mask = sam3._tokens(["chair " * 100])
    assert ids.shape == (1, 32) and mask.all()


def test_many_phrases_share_one_encoding_of_the_image(sam3, expected, prompts, monkeypatch):
    encodings = []
    encode = sam3.encode_image
    monkeypatch.setattr(sam3, "encode_image", lambda color: encodings.append(1) or encode(color))
    many = prompts * PROMPTS_AT_ONCE
    found = sam3.instances(expected["photo_0"], many)
    assert len(encodings) == 1 and len(found) == len(many)
    for index, several in enumerate(found):
        alone = found[index % len(prompts)]
        np.testing.assert_allclose([one.score for one in several], [one.score for one in alone], atol=1e-5)


def test_segments_carry_their_phrase_in_order_and_twins_are_suppressed(sam3, frame, expected, prompts):
    assert isinstance(sam3, Segmenter)
    segments = sam3.segment(frame(expected["photo_1"]), prompts)
    everything = sum(len(several) for several in sam3.instances(expected["photo_1"], prompts))
    assert 0 < len(segments) <= everything
    assert [s.phrase for s in segments] == sorted((s.phrase for s in segments), key=prompts.index)
    assert all(s.score > SCORE_THRESHOLD and s.pixels.shape == expected["photo_1"].shape[:2] for s in segments)
    assert sam3.segment(frame(expected["photo_1"]), []) == []


def test_a_query_counts_only_where_the_phrase_is_present():
    logits, boxes = np.array([4.0, -4.0]), np.array([[0.0, 0.25, 0.5, 1.0]] * 2)
    masks = np.full((2, 4, 4), 3.0, dtype=np.float32)
    [present] = instances(logits, np.array([4.0]), boxes, masks, size=(8, 6))
    assert present.box == (0.0, 2.0, 3.0, 8.0) and present.pixels.shape == (8, 6) and present.pixels.all()
    assert instances(logits, np.array([-4.0]), boxes, masks, size=(8, 6)) == []


def test_a_truncated_network_is_refused_by_name(tmp_path):
    folder = Path(shutil.copytree(FIXTURE, tmp_path / "sam3"))
    (folder / "decoder.onnx").write_bytes((FIXTURE / "decoder.onnx").read_bytes()[:1000])
    with pytest.raises(ModelFolderError, match=r"decoder\.onnx has 1000 bytes instead of"):
        Sam3Segmenter(folder, device="cpu")
