"""A picture as a network wants it: resized as Pillow does, which the reference implementations follow; normalised."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from PIL import Image

from openbelief.arrays import Array

INTERPOLATIONS = {"bilinear": Image.Resampling.BILINEAR, "bicubic": Image.Resampling.BICUBIC}


class PictureTransform:
    """(h, w, 3) uint8 RGB -> (3, size, size) float32.

    mode "squash" ignores the aspect ratio; "shortest" fits the shorter side and keeps the centre.
    """

    def __init__(
        self, size: int, mode: Literal["squash", "shortest"], interpolation: str, mean: Array, std: Array
    ) -> None:
        self.size = size
        self._mode, self._resample = mode, INTERPOLATIONS[interpolation]
        self._scale = (1.0 / (255.0 * np.asarray(std, dtype=np.float64))).astype(np.float32)
        self._offset = (-np.asarray(mean, dtype=np.float64) / np.asarray(std)).astype(np.float32)

    @classmethod
    def from_dict(cls, about: Mapping[str, Any]) -> PictureTransform:
        """The `picture` entry of model.json."""
        return cls(about["size"], about["mode"], about["interpolation"], about["mean"], about["std"])

    def __call__(self, color: Array) -> Array:
        resized = self._resized(Image.fromarray(np.ascontiguousarray(color)))
        pixels = np.asarray(resized, dtype=np.float32) * self._scale + self._offset
        return np.ascontiguousarray(pixels.transpose(2, 0, 1))

    def _resized(self, picture: Image.Image) -> Image.Image:
        if self._mode == "squash":
            return picture.resize((self.size, self.size), self._resample)
        width, height = picture.size
        short = min(width, height)
        width, height = self.size * width // short, self.size * height // short
        left, top = round((width - self.size) / 2), round((height - self.size) / 2)
        resized = picture.resize((width, height), self._resample)
        return resized.crop((left, top, left + self.size, top + self.size))
