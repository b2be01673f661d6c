"""Words and classes as unit rows: what an encoder gives is checked here."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True)
class TextSpace:
    """Where a memory's queries and classes are compared: the space of the text encoder that is named.

    encoder: None where only vectors can be asked.
    """

    encoder_id: str
    dim: int
    encoder: TextEncoder | None

    def words(self, texts: Sequence[str]) -> Array:
        """(n, d) float64 unit rows. Raises ValueError without an encoder."""
        return unit_rows(self._encode(texts), self.dim, "The encoder's row")

    def classes(self, classes: Sequence[str] | Array) -> Array:
        """(C, d) float64 unit rows of names or embeddings. Raises ValueError on none, or names without an encoder."""
        if isinstance(classes, str) or len(classes) == 0:
            raise ValueError("Classes should be a list of at least one name or embedding.")
        names = all(isinstance(c, str) for c in classes)
        return unit_rows(self._encode(classes) if names else classes, self.dim, "A class embedding")

    def vector(self, query: Any) -> Array:
        """(d,) float64 unit query. Raises ValueError on what is neither a sentence nor such a vector."""
        try:
            vector = np.asarray(query, dtype=np.float64)
        except (TypeError, ValueError):
            vector = np.empty(())
        if vector.ndim != 1:
            raise ValueError(f"The query should be a sentence or a (d,) vector, got {type(query).__name__}.")
        return unit_rows([vector], self.dim, "The query vector")[0]

    def _encode(self, texts: Sequence[str] | Array) -> Array:
        if self.encoder is None:
            raise ValueError(
                f"This memory was opened without a text encoder: open it with {self.encoder_id!r}, "
                "or ask with a vector."
            )
        return self.encoder.encode(list(texts))


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
