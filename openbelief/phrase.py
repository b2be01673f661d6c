"""Phrase hygiene: what a model or a person said, made comparable. The raw phrase stays with the evidence."""

from __future__ import annotations

import unicodedata
from functools import lru_cache

MAX_CHARACTERS = 60
MAX_WORDS = 8

# Things a robot is not sent to. The last word decides, so "floor lamp" and "door mat" stay objects.
BACKGROUND = (
    *("wall", "walls", "floor", "floors", "flooring", "ground", "ceiling", "ceilings"),
    *("window", "windows", "window frame", "door frame", "doorframe", "doorway", "doorways"),
    *("baseboard", "skirting board", "background"),
)


@lru_cache(maxsize=1024)  # a walk has a thousand observations and names them by a few hundred phrases
def comparable(raw: str | None) -> str | None:
    """Lower case, NFC, no control or zero-width characters, at most 8 words and 60 characters; None where none is left.

    No singularising ("glasses"). An instruction in a phrase is data like any other text.
    """
    if raw is None:
        return None
    words = clean(raw).lower().split()[:MAX_WORDS]
    while len(words) > 1 and len(" ".join(words)) > MAX_CHARACTERS:
        words.pop()
    return unicodedata.normalize("NFC", " ".join(words)[:MAX_CHARACTERS].strip()) or None


def clean(raw: str) -> str:
    """NFC text with control characters as spaces, and format (zero-width), private and unpaired characters dropped."""
    text = unicodedata.normalize("NFC", raw)
    return "".join(" " if c == "Cc" or c[0] == "Z" else letter for letter, c in _kinds(text) if c not in _INVISIBLE)


def printable(raw: str, limit: int = 120) -> str:
    """One line safe for a terminal or a log, at most `limit` characters: no control, no invisible characters."""
    line = " ".join(clean(raw).split())
    return line if len(line) <= limit else line[: limit - 3] + "..."


def with_article(phrase: str) -> str:
    """ "a sofa", "an umbrella", "shoes"."""
    plural = phrase.endswith("s") and not phrase.endswith(("ss", "us", "is"))
    return phrase if plural else f"{'an' if phrase[:1].lower() in 'aeiou' else 'a'} {phrase}"


def is_background(phrase: str) -> bool:
    """True where the phrase ends in a background word ("white wall", but not "wall clock")."""
    return any(phrase == word or phrase.endswith(" " + word) for word in BACKGROUND)


_INVISIBLE = ("Cf", "Cs", "Co", "Cn")


def _kinds(text: str) -> list[tuple[str, str]]:
    return [(letter, unicodedata.category(letter)) for letter in text]
