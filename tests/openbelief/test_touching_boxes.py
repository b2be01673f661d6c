"""Boxes that touch, found without comparing all with all."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from openbelief.touching_boxes import TouchingBoxes


@given(st.integers(0, 2**32 - 1), st.integers(1, 300), st.sampled_from([0.05, 0.5, 20.0]))
@settings(max_examples=60, deadline=None)
def test_the_boxes_found_are_those_that_touch_pair_by_pair(seed, n, largest_m):
    rng = np.random.default_rng(seed)
    low = rng.integers(-40, 40, (n, 3)) * 0.1
    low, high = low.astype(np.float32), (low + rng.integers(0, 5, (n, 3)) * largest_m / 4).astype(np.float32)
    boxes = TouchingBoxes(low, high, reach_m=0.1)
    grown = high.astype(np.float64) + 0.1
    touch = ((low[:, None] <= grown[None]) & (low[None] <= grown[:, None])).all(axis=2)
    np.fill_diagonal(touch, False)
    assert [sorted(boxes.of(i).tolist()) for i in range(n)] == [np.flatnonzero(row).tolist() for row in touch]
    assert sorted(boxes.order.tolist()) == list(range(n))


def test_where_all_touch_all_the_memory_is_bits() -> None:
    n = 2000
    boxes = TouchingBoxes(np.zeros((n, 3), np.float32), np.ones((n, 3), np.float32), reach_m=0.03)
    assert len(boxes.of(7)) == n - 1
    held = sum(part.nbytes for part in (*boxes._others, *boxes._bits))
    assert held < n * n / 3
