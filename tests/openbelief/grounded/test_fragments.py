"""Pieces pooled as by the matrix that they stand for."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from openbelief.grounded.fragments import Fragments
from openbelief.pieces import Pieces


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
@settings(max_examples=60, deadline=None)
def test_pooling_is_a_product_with_the_overlaps_and_groups_are_what_is_connected(seed, n):
    rng = np.random.default_rng(seed)
    chosen = np.argwhere(np.triu(rng.random((n, n)) < 1.0 / n, 1))
    pieces = Pieces(chosen.astype(np.int32), rng.random(len(chosen)))
    fragments = Fragments.of(pieces, 0.3, n)
    overlap = np.zeros((n, n))
    for (i, j), share in zip(chosen, pieces.share, strict=True):
        overlap[i, j] = overlap[j, i] = share if share >= 0.3 else 0.0
    values = rng.normal(size=(n, 5))
    np.testing.assert_allclose(fragments.pooled(values), values + overlap @ values, atol=1e-12)
    np.testing.assert_allclose(fragments.pooled(values[:, 0]), values[:, 0] + overlap @ values[:, 0], atol=1e-12)
    connected = np.linalg.matrix_power((overlap > 0) + np.eye(n), n) > 0
    assert fragments.group.tolist() == [int(np.flatnonzero(row)[0]) for row in connected]
