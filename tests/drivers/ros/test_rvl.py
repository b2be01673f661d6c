from __future__ import annotations

import numpy as np
import pytest

from drivers.ros import rvl


@pytest.mark.parametrize("seed", range(6))
def test_what_was_encoded_is_decoded_bit_for_bit(seed):
    rng = np.random.default_rng(seed)
    depth = rng.integers(0, 65536 if seed % 2 else 40, (12, 17)).astype(np.uint16)
    depth[rng.random(depth.shape) < 0.4] = 0
    np.testing.assert_array_equal(rvl.decode(rvl.encode(depth), depth.size).reshape(depth.shape), depth)


def test_the_papers_stream_by_hand():
    """Two zeros, three measured: 5, then +1, then -2; zigzag 10 (two nibbles), 2, 3; then one zero, none measured."""
    nibbles = [2, 3, 0b1010, 0b001, 2, 3, 1, 0]
    word = sum(nibble << (28 - 4 * i) for i, nibble in enumerate(nibbles))
    assert rvl.decode(word.to_bytes(4, "little"), 6).tolist() == [0, 0, 5, 6, 4, 0]


@pytest.mark.parametrize("data", [b"", bytes(16), b"\xff" * 16, b"\x77\x77\x77\x77"])
def test_what_is_no_stream_of_that_size_is_refused(data):
    with pytest.raises(rvl.RvlError):
        rvl.decode(data, 100)


def test_random_bytes_are_decoded_or_refused_never_anything_else():
    rng = np.random.default_rng(1)
    for _ in range(300):
        try:
            assert rvl.decode(rng.bytes(64), 50).shape == (50,)
        except rvl.RvlError:
            continue
