"""Words that may be misspelt: what the memory's own phrases offer instead. Offered, never applied."""

from __future__ import annotations

from collections.abc import Iterable

from openbelief.grounded.lexicon import is_word
from openbelief.request import words as w

OFFERED_MAX = 3
SHORTEST = 4  # letters; shorter words are one slip away from too many others


def did_you_mean(target: str, phrases: Iterable[str]) -> tuple[str, ...]:
    """The phrase with one word replaced by a word of the map that is within reach; () where every word is known.

    Within reach: one slip (a letter too many, too few, another, or two swapped) in words of 4 to 6 letters, two in
    longer ones.
    """
    known = {word for phrase in phrases for word in phrase.split()}
    words = target.split()
    offers: list[tuple[int, str]] = []
    for i, word in enumerate(words):
        if len(word) < SHORTEST or word in known or word.removesuffix("s") in known or is_word(word) or word in w.KNOWN:
            continue
        reach = 1 if len(word) < 7 else 2
        near = ((slips_between(word, other, reach), other) for other in known if len(other) >= SHORTEST)
        offers += [(n, " ".join([*words[:i], other, *words[i + 1 :]])) for n, other in near if n <= reach]
    return tuple(dict.fromkeys(text for _, text in sorted(offers)))[:OFFERED_MAX]


def slips_between(a: str, b: str, most: int) -> int:
    """The edits from one word to the other, a swap of neighbours counting one; `most` + 1 where there are more."""
    if abs(len(a) - len(b)) > most:
        return most + 1
    before, above = list(range(len(b) + 1)), list(range(len(b) + 1))
    for i, x in enumerate(a, start=1):
        row = [i, *([0] * len(b))]
        for j, y in enumerate(b, start=1):
            row[j] = min(above[j] + 1, row[j - 1] + 1, above[j - 1] + (x != y))
            if i > 1 and j > 1 and x == b[j - 2] and a[i - 2] == y:
                row[j] = min(row[j], before[j - 2] + 1)
        before, above = above, row
    return min(above[-1], most + 1)
