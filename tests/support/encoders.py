"""Text encoders without a model."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence

import numpy as np


class WordEncoder:
    """Phrases to unit rows: a phrase is the mean of its words, a word is its hash's direction."""

    def __init__(self, dim: int = 16, name: str = "words") -> None:
        self.id, self.dim = f"{name}=={dim}", dim

    def encode(self, texts: Sequence[str]) -> np.ndarray:
        rows = np.array([np.sum([self._word(word) for word in text.split()], axis=0) for text in texts])
        return (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)

    def _word(self, word: str) -> np.ndarray:
        seed = int.from_bytes(hashlib.sha256(word.encode()).digest()[:4])
        return np.random.default_rng(seed).normal(size=self.dim)


class AxisEncoder:
    """Each phrase lies on one axis: what lies on the same means the same, and nothing else is alike."""

    def __init__(self, axis_of: Callable[[str], int], dim: int, name: str = "axes") -> None:
        self.id, self.dim, self._axis_of = name, dim, axis_of
        self.asked: list[str] = []  # the phrases of the last call

    def encode(self, texts: Sequence[str]) -> np.ndarray:
        self.asked = list(texts)
        return np.eye(self.dim, dtype=np.float32)[[self._axis_of(text) for text in texts]]
