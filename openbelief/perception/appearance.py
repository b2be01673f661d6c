"""What a thing looks like, for association: features of a small classifier, which no text can be compared with."""

from __future__ import annotations

import os

import numpy as np

from openbelief.arrays import Array, normalize
from openbelief.perception.composed import BadModelOutput
from openbelief.perception.network_input import IMAGENET, network_input
from openbelief.perception.onnx_session import OnnxModel

SIDE, FEATURES, DIM = 224, 1280, 512


class MobileNetAppearance:
    """MobileNetV2 of picture crops, turned into 512 numbers by a fixed random projection that keeps angles."""

    dim = DIM

    def __init__(self, path: str | os.PathLike[str], *, threads: int | None = None) -> None:
        shapes = {"image": (None, 3, SIDE, SIDE)}, {"feature": (None, FEATURES)}
        self._model = OnnxModel(path, inputs=shapes[0], outputs=shapes[1], threads=threads)
        self._projection = np.linalg.qr(np.random.default_rng(0).normal(size=(FEATURES, DIM)))[0]

    @property
    def id(self) -> str:
        return f"{self._model.id} projected to {DIM}"

    def encode(self, crops: list[Array]) -> Array:
        """(n, 512) float32 unit rows of n (h, w, 3) uint8 RGB crops, in one batch. Raises BadModelOutput."""
        if not crops:
            return np.zeros((0, DIM), dtype=np.float32)
        batch = np.stack([network_input(crop, SIDE, IMAGENET) for crop in crops])
        rows = self._model.run({"image": batch}, ["feature"])[0]
        if rows.shape != (len(crops), FEATURES) or not np.isfinite(rows).all():
            raise BadModelOutput(
                f"{self._model.path} gave {rows.shape}, finite ({len(crops)}, {FEATURES}) was expected."
            )
        return normalize(rows.astype(np.float64) @ self._projection).astype(np.float32)
