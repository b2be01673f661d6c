"""What a promptable segmenter makes of a clean silhouette: ragged, bleeding, split, doubled or missed."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.run_lengths import mask_bbox


@dataclass(frozen=True)
class MaskNoise:
    """Probabilities per mask, and lengths in pixels."""

    missed: float = 0.06
    split: float = 0.05
    doubled: float = 0.05
    bleeds: float = 0.10
    ragged_px: int = 4  # the border wanders by up to this much
    bleed_px: int = 14
    smallest_px: int = 150  # below this nothing is segmented


def ragged_masks(silhouette: Array, noise: MaskNoise, rng: np.random.Generator) -> list[Array]:
    """The (h, w) bool masks that come out for one (h, w) bool silhouette: none, one, or two."""
    if np.count_nonzero(silhouette) < noise.smallest_px or rng.random() < noise.missed:
        return []
    window = _window(silhouette, 2 * noise.bleed_px)
    masks = []
    for part in _segmented(silhouette[window], noise, rng):
        whole = np.zeros_like(silhouette)
        whole[window] = part
        masks.append(whole)
    return [m for m in masks if np.count_nonzero(m) >= noise.smallest_px]


def _window(silhouette: Array, margin: int) -> tuple[slice, slice]:
    x0, y0, x1, y1 = mask_bbox(silhouette)
    return np.s_[max(y0 - margin, 0) : y1 + margin, max(x0 - margin, 0) : x1 + margin]


def _segmented(silhouette: Array, noise: MaskNoise, rng: np.random.Generator) -> list[Array]:
    mask = _ragged(silhouette, noise, rng)
    fate = rng.random()
    if fate < noise.split:
        return _split(mask, rng)
    return [mask, _ragged(silhouette, noise, rng)] if fate < noise.split + noise.doubled else [mask]


def _ragged(silhouette: Array, noise: MaskNoise, rng: np.random.Generator) -> Array:
    """The border moved in and out by a smooth random field; now and then it bleeds over one side."""
    distance = _signed_distance(silhouette)
    coarse = rng.uniform(-1, 0.6, (12, 16)).astype(np.float32)
    field = cv2.resize(coarse, silhouette.shape[::-1], interpolation=cv2.INTER_CUBIC) * noise.ragged_px
    if rng.random() < noise.bleeds:
        u, v = rng.integers(0, silhouette.shape[::-1])
        yy, xx = np.ogrid[: silhouette.shape[0], : silhouette.shape[1]]
        field = field + noise.bleed_px * np.exp(-((xx - u) ** 2 + (yy - v) ** 2) / (2 * (0.2 * xx.size) ** 2))
    return distance + field > 0


def _signed_distance(silhouette: Array) -> Array:
    """Pixels to the border: positive inside, negative outside."""
    inside = cv2.distanceTransform(silhouette.astype(np.uint8), cv2.DIST_L2, 3)
    outside = cv2.distanceTransform((~silhouette).astype(np.uint8), cv2.DIST_L2, 3)
    return inside - outside


def _split(mask: Array, rng: np.random.Generator) -> list[Array]:
    """Two halves along a random line through the middle."""
    rows, columns = np.nonzero(mask)
    if not len(rows):
        return []
    angle = rng.uniform(0, np.pi)
    side = (np.mgrid[0 : mask.shape[0], 0 : mask.shape[1]].transpose(1, 2, 0) - [rows.mean(), columns.mean()]) @ [
        np.sin(angle),
        np.cos(angle),
    ]
    return [mask & (side > 0), mask & (side <= 0)]
