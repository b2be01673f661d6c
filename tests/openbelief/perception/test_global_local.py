from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.perception.global_local import GlobalLocalFeatures, combine, crops
from openbelief.perception.ports import SegmentedMask


def unit(rng: np.random.Generator, *shape: int) -> np.ndarray:
    rows = rng.normal(size=shape)
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


class MeanColour:
    """ImageEncoder: a picture's mean colour, as a direction; it remembers what it was shown."""

    id, dim, text_space = "mean-colour", 3, None

    def __init__(self) -> None:
        self.batches: list[list[np.ndarray]] = []

    def encode(self, images: Sequence[np.ndarray]) -> np.ndarray:
        self.batches.append(list(images))
        means = np.array([image.reshape(-1, 3).mean(axis=0) + 1e-3 for image in images])
        return (means / np.linalg.norm(means, axis=1, keepdims=True)).astype(np.float32)


def picture() -> RgbdFrame:
    """A red square on blue, 200 x 100."""
    color = np.zeros((100, 200, 3), np.uint8)
    color[..., 2] = 200
    color[40:60, 90:110] = (250, 0, 0)
    return RgbdFrame(0, 1, color, np.ones((100, 200), np.float32), Intrinsics(200, 100, 99, 99, 99, 49), np.eye(4))


def square() -> SegmentedMask:
    pixels = np.zeros((100, 200), bool)
    pixels[40:60, 90:110] = True
    return SegmentedMask("red square", 0.9, pixels)


def test_one_mask_in_a_frame_keeps_its_own_look():
    """The published softmax gives a single mask w = 1: the whole image instead of the object."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        whole, masked, box = unit(rng, 16), unit(rng, 1, 16), unit(rng, 1, 16)
        local = 0.4418 * masked[0] + 0.5582 * box[0]
        local /= np.linalg.norm(local)
        feature = combine(whole, masked, box)[0]
        assert feature @ local > 0.99
        expected = 0.1 * whole + 0.9 * local
        np.testing.assert_allclose(feature, expected / np.linalg.norm(expected), atol=1e-12)


def test_with_many_masks_the_softmax_shares_out_the_frame():
    rng = np.random.default_rng(1)
    m = 40
    whole, masked = unit(rng, 8), unit(rng, m, 8)
    local = masked  # masked crop and box crop the same: F_l is both
    shares = np.exp(local @ whole) / np.exp(local @ whole).sum()
    assert shares.max() < 0.1
    expected = shares[:, None] * whole + (1 - shares[:, None]) * local
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(combine(whole, masked, masked), expected, atol=1e-12)


def test_the_frame_and_all_crops_are_one_batch():
    encoder = MeanColour()
    rows = GlobalLocalFeatures(encoder).encode(picture(), [square(), square()])
    assert rows.shape == (2, 3) and rows.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(rows, axis=1), 1, atol=1e-6)
    assert [len(batch) for batch in encoder.batches] == [5]


def test_the_masked_crop_blackens_what_is_not_the_mask_and_the_box_keeps_its_margin():
    frame, segment = picture(), square()
    masked, box = crops(frame.color, segment.pixels)
    assert box.shape == (100, 120, 3)  # 50 px each side, cut at the image's border
    np.testing.assert_array_equal(box, frame.color[:, 40:160])
    assert (masked.reshape(-1, 3).any(axis=1)).sum() == 400
    np.testing.assert_array_equal(masked[40:60, 50:70], frame.color[40:60, 90:110])


def test_no_mask_asks_the_encoder_nothing():
    encoder = MeanColour()
    assert GlobalLocalFeatures(encoder).encode(picture(), []).shape == (0, 3)
    assert encoder.batches == []
