"""A phrase without its colour word, and the colour: a detector's "blue tv" is a tv that looked blue once."""

from __future__ import annotations

from openbelief.request.words import COLOURS

SPELT = {"grey": "gray", "violet": "purple", "gold": "yellow", "golden": "yellow", "lime": "green", "navy": "blue"}
SPELT |= {"teal": "turquoise", "cyan": "turquoise", "magenta": "pink", "maroon": "red"}
SHADES = frozenset(("dark", "light", "bright", "pale", "deep", "vivid"))


def without_colour(phrase: str) -> str:
    """ "red floor lamp" -> "floor lamp"; a phrase of colour words only stays as it is."""
    kept = [word for word in _unshaded(phrase) if word not in COLOURS]
    return " ".join(kept) if kept else phrase


def colours_of(phrase: str) -> frozenset[str]:
    """The colours that a phrase names, one word for each; none where nothing but colours is named."""
    words = _unshaded(phrase)
    found = frozenset(SPELT.get(word, word) for word in words if word in COLOURS)
    return found if len(found) < len(words) else frozenset()


def _unshaded(phrase: str) -> list[str]:
    """ "dark red" is red, and "black and white" is both; "light" alone is a lamp."""
    words = phrase.split()
    if COLOURS.isdisjoint(words):
        return words
    coloured = [word in COLOURS for word in words]
    before, after = [False, *coloured[:-1]], [*coloured[1:], False]
    return [
        word
        for word, behind, ahead in zip(words, before, after, strict=True)
        if not (ahead and (word in SHADES or (word == "and" and behind)))
    ]
