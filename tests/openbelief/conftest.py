"""A tiny text space and a maker of observations: evidence small enough to reason about by hand."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from openbelief import ObjectMemory, Observation, Parameters
from openbelief.observation import Provenance
from support.encoders import WordEncoder


@pytest.fixture
def tiny_encoder() -> WordEncoder:
    return WordEncoder(name="tiny")


@pytest.fixture
def observe() -> Callable[..., Observation]:
    """observe(phrase, at=(x, y, z), frame=, mask=, ...): a snapped 0.2 m block of points that looks like `look`."""

    def make(
        phrase: str | None,
        *,
        at: tuple[float, float, float] = (0.0, 0.0, 0.0),
        frame: int = 0,
        mask: int = 0,
        confidence: float = 0.9,
        look: int = 0,
        side: int = 10,
        dim: int = 16,
        recording: str | None = None,
    ) -> Observation:
        block = np.stack(np.meshgrid(*[np.arange(side)] * 3), axis=-1).reshape(-1, 3)
        points = ((block + np.round(np.array(at) / 0.02) + 0.5) * 0.02).astype(np.float32)
        feature = np.eye(dim, dtype=np.float32)[look]
        source = None
        if recording is not None:
            rle = {"size": [4, 4], "counts": [3, 5, 8]}
            source = Provenance(recording, 1000 + frame, (0, 0, 2, 4), rle, b"\xff\xd8jpeg")
        return Observation(frame, mask, phrase, confidence, points, feature, source)

    return make


@pytest.fixture
def flat(observe: Callable[..., Observation]) -> list[Observation]:
    """Two chairs, a lamp that one view calls a hat stand, and a wall, far apart; seen in four frames of "walk"."""
    views = []
    for frame in range(4):
        lamp = "hat stand" if frame == 3 else "floor lamp"
        said = [("red chair", (0, 0, 0)), ("chair", (2, 0, 0)), (lamp, (4, 0, 0)), ("white wall", (6, 0, 0))]
        views += [
            observe(phrase, at=at, frame=frame, mask=mask, look=mask, recording="walk")
            for mask, (phrase, at) in enumerate(said)
        ]
    return views


@pytest.fixture
def memory(flat: list[Observation], tiny_encoder: WordEncoder) -> ObjectMemory:
    return ObjectMemory.build(flat, tiny_encoder, Parameters(), about={"perception": "by hand"})


@pytest.fixture
def path(memory: ObjectMemory, tmp_path: Path) -> Path:
    """Its file."""
    memory.save(tmp_path / "site.belief")
    return tmp_path / "site.belief"
