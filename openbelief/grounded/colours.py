"""A phrase without its colour word, and the colour: a detector's "blue tv" is a tv that looked blue once."""

from __future__ import annotations

from openbelief.request.words import COLOURS

SPELT = {"grey": "gray", "violet": "purple", "gold": "yellow", "golden": "yellow", "lime": "green", "navy": "blue"}
SPELT |= {"teal": "turquoise", "cyan": "turquoise", "magenta": "pink", "maroon": "red"}


def without_colour(phrase: str) -> str:
    """ "red floor lamp" -> "floor lamp"; a phrase of colour words only stays as it is."""
    words = phrase.split()
    kept = [word for word in words if word not in COLOURS]
    return " ".join(kept) if kept else phrase


def colours_of(phrase: str) -> frozenset[str]:
    """The colours that a phrase names, one word for each; none where nothing but colours is named."""
    words = phrase.split()
    found = frozenset(SPELT.get(word, word) for word in words if word in COLOURS)
    return found if len(found) < len(words) else frozenset()
