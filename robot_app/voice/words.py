"""Words as they are compared: lower case, without punctuation; and how many of them are wrong."""

from __future__ import annotations

import re
from collections.abc import Sequence

WORD = re.compile(r"[^\W_]+(?:'[^\W_]+)?")


def words_of(text: str) -> list[str]:
    """["don't", "stop"] of "Don't stop!"."""
    return WORD.findall(text.lower().replace("\u2019", "'"))


def word_errors(said: Sequence[str], heard: Sequence[str]) -> int:
    """Substitutions, deletions and insertions of the cheapest alignment (Levenshtein over words)."""
    row = list(range(len(heard) + 1))
    for i, word in enumerate(said, start=1):
        before, row[0] = row[0], i
        for j, other in enumerate(heard, start=1):
            before, row[j] = row[j], min(row[j] + 1, row[j - 1] + 1, before + (word != other))
    return row[-1]


def words_in_common(first: str, second: str) -> float:
    """1 where both say the same words, 0 where none is shared: 1 - errors / the longer's number of words."""
    a, b = words_of(first), words_of(second)
    return 1.0 - word_errors(a, b) / max(len(a), len(b), 1)
