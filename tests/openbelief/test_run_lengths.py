"""Run lengths are those of every pixel, and lead back to the mask."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from openbelief.run_lengths import decode_rle, encode_rle, mask_bbox


def run_lengths(pixels: np.ndarray) -> list[int]:
    """COCO's, pixel by pixel down the columns."""
    counts, value = [0], False
    for pixel in pixels.T.ravel().tolist():
        if pixel != value:
            counts.append(0)
            value = pixel
        counts[-1] += 1
    return counts


@given(st.integers(0, 2**32 - 1), st.integers(1, 7), st.integers(1, 7), st.sampled_from([0.0, 0.1, 0.5, 0.9, 1.0]))
@settings(max_examples=200, deadline=None)
def test_run_lengths_are_those_of_every_pixel_and_lead_back_to_the_mask(seed, height, width, filled):
    pixels = np.random.default_rng(seed).random((height, width)) < filled
    rle = encode_rle(pixels)
    assert rle == {"size": [height, width], "counts": run_lengths(pixels)}
    np.testing.assert_array_equal(decode_rle(rle), pixels)
    if pixels.any():
        rows, columns = np.nonzero(pixels)
        assert mask_bbox(pixels) == (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)


@given(st.lists(st.integers(0, 5), min_size=1, max_size=9))
def test_run_lengths_of_others_may_hold_empty_runs(counts):
    counts.append(12 - sum(counts) % 12)
    values = [i % 2 == 1 for i, count in enumerate(counts) for _ in range(count)]
    size = [4, sum(counts) // 4]
    pixels = decode_rle({"size": size, "counts": counts})
    assert pixels.T.ravel().tolist() == values and list(pixels.shape) == size
