from __future__ import annotations

import numpy as np
import pytest

from openbelief.perception.ports import TextEncoder
from openbelief.perception.sentence import SentenceEncoder


@pytest.fixture(scope="module")
def encoder():
    return SentenceEncoder()


def test_rows_are_unit_float32_one_per_text_in_order(encoder):
    rows = encoder.encode(["sofa", "couch", "sofa"])
    assert rows.shape == (3, 512) and rows.dtype == np.float32
    assert np.linalg.norm(rows, axis=1) == pytest.approx(1.0, abs=1e-6)
    assert (rows[0] == rows[2]).all()


def test_a_phrase_means_the_same_alone_and_in_company(encoder):
    company = SentenceEncoder().encode(["desk lamp", "a very long phrase with many words in it", "cup"])
    assert encoder.encode(["desk lamp"])[0] == pytest.approx(company[0], abs=1e-6)


def test_synonyms_are_nearer_than_strangers(encoder):
    sofa, couch, lamp = encoder.encode(["sofa", "couch", "lamp"])
    assert sofa @ couch > 0.75 > 0.55 > sofa @ lamp


def test_nothing_gives_no_rows_and_it_is_a_text_encoder(encoder):
    assert encoder.encode([]).shape == (0, 512)
    assert isinstance(encoder, TextEncoder)
