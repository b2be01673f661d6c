"""Small sites for the readout `grounded`: boxes with what was said of them, and the real sentence encoder."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from openbelief import ObjectMemory, Observation
from openbelief.arrays import normalize
from openbelief.perception.sentence import SentenceEncoder

ENCODER = SentenceEncoder()
STEP_M = 0.04


class Site:
    """Things are added one by one; their ids are those of the memory, in the order in which they were added."""

    def __init__(self) -> None:
        self._views: list[Observation] = []
        self._count = 0

    def add(
        self,
        said: str | Sequence[str],
        at: tuple[float, float] | tuple[float, float, float],
        size: float | tuple[float, float, float] = 0.3,
        looks: int = 3,
        name: str | None = None,
    ) -> int:
        """said: a phrase, or the phrases in turn. at: the middle of its bottom. name: what its feature is of."""
        phrases = [said] if isinstance(said, str) else list(said)
        w, d, h = (size, size, size) if isinstance(size, float) else size
        x, y, z = (*at, 0.0)[:3]
        points = _box(np.array([x - w / 2, y - d / 2, z]), np.array([x + w / 2, y + d / 2, z + h]))
        feature = _looks_like(name or phrases[0], self._count)
        for k in range(max(looks, len(phrases))):
            self._views.append(Observation(100 * self._count + k, 0, phrases[k % len(phrases)], 0.9, points, feature))
        self._count += 1
        return self._count - 1

    def memory(self, **more) -> ObjectMemory:
        return ObjectMemory.build(self._views, ENCODER, **more)


def _box(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(n, 3) points on the surface of a box."""
    axes = [np.arange(a, b + STEP_M / 2, STEP_M) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    edge = (np.abs(grid - low) < STEP_M / 2).any(axis=1) | (np.abs(grid - high) < STEP_M).any(axis=1)
    return grid[edge].astype(np.float32)


def _looks_like(name: str, number: int) -> np.ndarray:
    """Near the name's embedding as an image's feature is, and unlike every other thing's."""
    rng = np.random.default_rng([number, 7])
    own = normalize(rng.standard_normal(ENCODER.dim))
    return normalize(0.3 * ENCODER.encode([name])[0] + 0.95 * own).astype(np.float32)


@pytest.fixture
def site() -> Site:
    return Site()


@pytest.fixture
def first() -> Callable[..., int]:
    """The best object's id for a sentence."""

    def best(memory: ObjectMemory, sentence: str, **more) -> int:
        return memory.answer(sentence, **more).candidates[0].object_id

    return best
