"""Words and classes as unit rows: what an encoder gives is checked here."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from openbelief.arrays import Array, read_only
from openbelief.observation import Observation
from openbelief.perception.ports import TextEncoder
from openbelief.phrase import comparable


class PhraseEmbeddings(Mapping[str, Array]):
    """Every comparable phrase, in alphabetical order, with its embedding, (d,) float32 unit length, as a matrix.

    rows: (P, d), or what reads them when one is asked for.
    """

    def __init__(self, phrases: Sequence[str], rows: Array | Callable[[], Array]) -> None:
        self.phrases, self._rows = tuple(phrases), rows

    @cached_property
    def rows(self) -> Array:
        """(P, d) float32, read-only."""
        return self._rows() if callable(self._rows) else self._rows

    @cached_property
    def _row(self) -> dict[str, int]:
        return {phrase: row for row, phrase in enumerate(self.phrases)}

    def __getitem__(self, phrase: str) -> Array:
        return self.rows[self._row[phrase]]

    def __iter__(self) -> Iterator[str]:
        return iter(self.phrases)

    def __len__(self) -> int:
        return len(self.phrases)


def embed_phrases(evidence: Sequence[Observation], encoder: TextEncoder) -> PhraseEmbeddings:
    """Every comparable phrase of the evidence."""
    phrases = sorted({phrase for o in evidence if (phrase := comparable(o.phrase))})
    if not phrases:
        return PhraseEmbeddings((), read_only(np.zeros((0, encoder.dim), np.float32)))
    rows = unit_rows(encoder.encode(phrases), encoder.dim, f"The row of encoder {encoder.id!r}")
    if len(rows) != len(phrases):
        raise ValueError(f"Encoder {encoder.id!r} gave {len(rows)} rows for {len(phrases)} phrases.")
    return PhraseEmbeddings(phrases, read_only(rows.astype(np.float32)))


def unit_rows(rows: Array | Sequence[Any], dim: int, what: str) -> Array:
    """(n, dim) float64 unit rows; raises ValueError on other shapes, non-finite numbers and zero rows."""
    array = np.asarray(rows, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != dim:
        raise ValueError(f"{what} should have {dim} numbers, got shape {array.shape}.")
    norms = np.linalg.norm(array, axis=1, keepdims=True)
    if not np.isfinite(norms).all() or (norms == 0).any():
        raise ValueError(f"{what} should be finite and not zero.")
    return array / norms
