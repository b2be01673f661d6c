"""What is said of nodes, by hand and in columns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from openbelief.arrays import highest, normalize
from openbelief.grounded import entries as module
from openbelief.grounded.entries import Entries, beliefs, lengths, product_of
from openbelief.grounded.options import GroundedOptions


def some(seed: int, n: int) -> tuple[Entries, np.ndarray, np.ndarray]:
    """Entries of n nodes, some of which nobody spoke of; vectors of 7 phrases, and features."""
    rng = np.random.default_rng(seed)
    keys = np.flatnonzero(rng.random(n * 7) < 0.3)
    row, phrase = np.divmod(keys, 7)
    vectors, features = (normalize(rng.normal(size=(k, 12))).astype(np.float32) for k in (7, n))
    return Entries(row, phrase, rng.uniform(0, 5, len(keys))), vectors, features


@given(st.integers(0, 2**32 - 1), st.integers(1, 30), st.sampled_from([2, 2048]))
@settings(max_examples=60, deadline=None)
def test_a_length_is_that_of_the_sum_with_few_phrases_and_with_many(seed, n, most_at_once):
    entries, vectors, _ = some(seed, n)
    belief = np.random.default_rng(seed).random(len(entries.row))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "GRAM_MAX", most_at_once)
        patch.setattr(module, "AT_ONCE", most_at_once)
        found = lengths(entries, belief, product_of(vectors), n)
    sums = np.zeros((n, 12))
    np.add.at(sums, entries.row, belief[:, None] * vectors[entries.phrase])
    np.testing.assert_allclose(found, np.linalg.norm(sums, axis=1), atol=1e-7)


@given(st.integers(0, 2**32 - 1), st.integers(1, 30), st.booleans())
@settings(max_examples=60, deadline=None)
def test_beliefs_of_a_node_are_the_softmax_of_support_and_looks(seed, n, aligned):
    entries, vectors, features = some(seed, n)
    options = GroundedOptions()
    found = beliefs(entries, vectors, features if aligned else None, options)
    for node in np.unique(entries.row):
        mine = entries.row == node
        raw = (entries.support[mine] + options.support_prior) ** options.support_power
        if aligned:
            raw = raw * np.exp(options.visual_gain * (vectors[entries.phrase[mine]] @ features[node]))
        np.testing.assert_allclose(found[mine], raw / raw.sum(), rtol=1e-5)


@given(st.lists(st.sampled_from([-np.inf, -1.0, 0.0, 0.5, 2.0]), max_size=30), st.integers(0, 9))
@settings(max_examples=60, deadline=None)
def test_the_highest_are_the_first_of_all_sorted_and_of_equal_ones_the_lowest_rows(values, count):
    values = np.array(values, np.float64)
    assert highest(values, count).tolist() == np.argsort(-values, kind="stable")[:count].tolist()
