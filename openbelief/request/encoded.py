"""A request with its words embedded: parsed once, encoded once, the same object for ranking, checking and record."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from openbelief.arrays import Array
from openbelief.request.request import Request

Encode = Callable[[Sequence[str]], Array]  # (n, d) float64 unit rows, checked


class EncodedRequest:
    """f_q of a request, and the vector of any other word that answering it takes; each text is encoded once."""

    def __init__(self, request: Request, encode: Encode) -> None:
        self.request, self._encode = request, encode
        self._known: dict[str, Array] = {}

    @property
    def f_q(self) -> Array:
        """(d,) float64 unit length: of the text that the paper's readouts compare."""
        return self.of([self.request.text])[0]

    def of(self, texts: Sequence[str]) -> Array:
        """(n, d) float64 unit rows."""
        if missing := [text for text in dict.fromkeys(texts) if text not in self._known]:
            self._known.update(zip(missing, self._encode(missing), strict=True))
        return np.array([self._known[text] for text in texts])
