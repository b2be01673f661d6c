"""Words and classes as unit rows: what an encoder gives is checked at the door."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from openbelief.arrays import Array, read_only
from openbelief.observation import Observation
from openbelief.perception.ports import TextEncoder
from openbelief.phrase import comparable


def embed_phrases(evidence: Sequence[Observation], encoder: TextEncoder) -> dict[str, Array]:
    """Every comparable phrase with its embedding, (d,) float32 unit length."""
    phrases = sorted({phrase for o in evidence if (phrase := comparable(o.phrase))})
    if not phrases:
        return {}
    rows = unit_rows(encoder.encode(phrases), encoder.dim, f"The row of encoder {encoder.id!r}")
    if len(rows) != len(phrases):
        raise ValueError(f"Encoder {encoder.id!r} gave {len(rows)} rows for {len(phrases)} phrases.")
    return {phrase: read_only(row.astype(np.float32)) for phrase, row in zip(phrases, rows, strict=True)}


def unit_rows(rows: Array | Sequence[Any], dim: int, what: str) -> Array:
    """(n, dim) float64 unit rows; raises ValueError on other shapes, non-finite numbers and zero rows."""
    array = np.asarray(rows, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != dim:
        raise ValueError(f"{what} should have {dim} numbers, got shape {array.shape}.")
    norms = np.linalg.norm(array, axis=1, keepdims=True)
    if not np.isfinite(norms).all() or (norms == 0).any():
        raise ValueError(f"{what} should be finite and not zero.")
    return array / norms
