"""What a D435 would have measured where the renderer says what is there."""

from __future__ import annotations

import cv2
import numpy as np

from openbelief.arrays import Array

BASELINE_M = 0.05
FOCAL_PX = 640.0  # of the depth module's own images: with the baseline, one pixel of disparity
SUBPIXEL = 32  # disparity comes in steps of 1/32 px
DEPTH_RANGE_M = (0.28, 6.0)
SIGMA_M, SIGMA_PER_M2 = 0.001, 0.0012
CORRELATION_PX = 1.5
SHADOW_STEPS_PX = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48)
GRAZING = 0.12  # surfaces seen at a flatter angle than this sine return holes
DARK = 30  # mean RGB under which the pattern does not come back
DARK_HOLES = 0.35


def noisy_depth(depth_m: Array, color: Array, *, seed: int, stamp_ns: int) -> Array:
    """(h, w) float32 metres, 0 = no measurement, of an ideal (h, w) depth and its (h, w, 3) colour.

    Correlated noise growing with z^2, quantised disparity, stereo shadow left of foreground edges, holes at edges and
    on grazing and dark surfaces. The same seed and stamp give the same bytes.
    """
    rng = np.random.default_rng([seed, stamp_ns & 0xFFFFFFFF, stamp_ns >> 32, 0xD435])
    z = np.where(depth_m > 0, depth_m, 1e3).astype(np.float32)
    noisy = z + _correlated(rng, z.shape) * (SIGMA_M + SIGMA_PER_M2 * z * z)
    noisy = _quantised(noisy)
    lost = (depth_m <= 0) | _stereo_shadow(z) | _edges(z, rng) | _grazing(z) | _dark(color, rng)
    lost |= (noisy < DEPTH_RANGE_M[0]) | (noisy > DEPTH_RANGE_M[1])
    return np.where(lost, 0, noisy).astype(np.float32)


def _correlated(rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Unit-variance noise whose neighbours agree over a few pixels."""
    noise = cv2.GaussianBlur(rng.standard_normal(shape, dtype=np.float32), (0, 0), CORRELATION_PX)
    return noise / max(float(noise.std()), 1e-9)


def _quantised(z: Array) -> Array:
    disparity = np.round(FOCAL_PX * BASELINE_M / z * SUBPIXEL) / SUBPIXEL
    return np.where(disparity > 0, FOCAL_PX * BASELINE_M / np.maximum(disparity, 1 / SUBPIXEL), 0)


def _stereo_shadow(z: Array) -> Array:
    """Background that only one of the two imagers sees: as wide as the jump in disparity, left of the foreground."""
    disparity = FOCAL_PX * BASELINE_M / z
    hidden = np.zeros(z.shape, bool)
    for step in SHADOW_STEPS_PX:
        nearer = np.zeros_like(z)
        nearer[:, :-step] = disparity[:, step:]
        hidden |= nearer - disparity >= step
    return hidden


def _edges(z: Array, rng: np.random.Generator) -> Array:
    """A ragged line along every jump in depth."""
    jump = (cv2.dilate(z, np.ones((3, 3))) - cv2.erode(z, np.ones((3, 3)))) > 0.05 * z
    return jump & (rng.random(z.shape, dtype=np.float32) < 0.75)


def _grazing(z: Array) -> Array:
    """Slopes along which depth changes by much more than a pixel is wide."""
    slope = np.hypot(cv2.Sobel(z, cv2.CV_32F, 1, 0, scale=0.125), cv2.Sobel(z, cv2.CV_32F, 0, 1, scale=0.125))
    return slope * FOCAL_PX * GRAZING > z


def _dark(color: Array, rng: np.random.Generator) -> Array:
    """Patches of dark surfaces."""
    dark = color.mean(axis=2) < DARK
    patches = cv2.resize(rng.random((color.shape[0] // 8, color.shape[1] // 8), dtype=np.float32), color.shape[1::-1])
    return dark & (patches < DARK_HOLES)
