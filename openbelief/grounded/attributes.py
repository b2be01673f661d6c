"""The words that say what a thing is like, and which of them deny each other: red and gray, wooden and plastic."""

from __future__ import annotations

import re
from functools import lru_cache

from openbelief.grounded.lexicon import is_known
from openbelief.request.words import GENERIC

# The words between two bars mean the same, and deny all others of their kind. A word that stands twice lies between and
# denies neither: what one calls turquoise is blue or green to others.
_KINDS = {
    "colour": """
        red maroon | orange | yellow gold golden beige lime | green lime turquoise teal cyan | blue navy turquoise teal
        cyan | purple violet magenta | pink magenta | brown maroon beige gold golden | black navy | white beige silver
        | gray grey silver""",
    "size": "big large huge | small little tiny",
    "height": "tall | short low",
    "length": "long | short",
    "width": "wide | narrow",
    "shape": "round circular oval | square rectangular",
    "material": """
        wooden wood bamboo | metal metallic steel iron aluminium aluminum chrome | plastic | glass | leather | fabric
        cloth cotton wool woollen velvet | stone marble granite concrete | ceramic porcelain clay | cardboard paper
        | rubber | wicker rattan bamboo""",
}
DESCRIBED = re.compile(r"(?P<thing>\S.*?) (?:with|without|to|for|of|made of|that|which) (?:an? |the )?(?P<what>\S.*)")
MEASURES = frozenset(("pair", "piece", "set", "kind", "sort", "type", "box full", "bit"))
Attributes = dict[str, frozenset[str]]  # the words of each kind


def _rows_of(words: str) -> dict[str, frozenset[int]]:
    """The rows of each word."""
    rows = [row.split() for row in words.split("|")]
    return {word: frozenset(n for n, row in enumerate(rows) if word in row) for row in rows for word in row}


ROWS = {kind: _rows_of(words) for kind, words in _KINDS.items()}


@lru_cache(maxsize=65536)
def attributes_of(text: str) -> Attributes:
    """What stands before the name: "small red chair with a blue cushion" -> {"colour": {"red"}, "size": {"small"}}.

    A word of the name says nothing: a paper shredder is of no paper, and a white board is a board to write on.
    """
    words = _thing_of(text)
    before = words[: _name_at(words)]
    found = {kind: frozenset(word for word in before if word in rows) for kind, rows in ROWS.items()}
    return {kind: said for kind, said in found.items() if said}


def alternatives_of(text: str) -> list[str]:
    """The things of which one will do; "red or blue chair" are a red chair and a blue chair."""
    *others, last = [one.strip() for one in text.split(" or ") if one.strip()]
    noun = last.split()[-1]
    return [*(f"{one} {noun}" if _is_attribute(one) else one for one in others), last]


def denies(kind: str, said: frozenset[str], asked: frozenset[str]) -> bool:
    """Whether no word that was said means one that is asked for."""
    rows = ROWS[kind]
    return bool(said) and not any(rows[a] & rows[b] for a in said for b in asked)


def _thing_of(text: str) -> list[str]:
    """Without what it is with, or for."""
    found = DESCRIBED.match(text)
    if found is None:
        return text.split()
    return (found["what"] if found["thing"] in MEASURES else found["thing"]).split()


def _name_at(words: list[str]) -> int:
    """Where the longest name that the lexicon knows begins, or the last word; "something red" ends before it."""
    if words and words[0] in GENERIC:
        return len(words)
    return next((at for at in range(len(words)) if is_known(" ".join(words[at:]))), len(words) - 1)


def _is_attribute(words: str) -> bool:
    return all(any(word in rows for rows in ROWS.values()) for word in words.split())
