"""The words that give a sentence its parts: tables that the parser reads, and nothing else.

An entry is words as they follow each other in a lower-case sentence; longer entries are tried first.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, TypeVar

Words = tuple[str, ...]
Name = TypeVar("Name")

RelationKind = Literal[
    "next to",
    "nearest to",
    "farthest from",
    "on",
    "under",
    "in",
    "between",
    "in front of",
    "behind",
    "left of",
    "right of",
    "with",
]
WhichKind = Literal[
    "nearest", "farthest", "largest", "smallest", "tallest", "lowest", "left-most", "right-most", "other"
]


def _listed(text: str) -> tuple[Words, ...]:
    """Entries between commas, the longest first."""
    return tuple(sorted((tuple(entry.split()) for entry in text.split(",")), key=lambda words: -len(words)))


def _set(text: str) -> frozenset[str]:
    return frozenset(word for (word,) in _listed(text))


def _table(rows: Mapping[Name, str]) -> dict[Words, Name]:
    flat = {words: name for name, text in rows.items() for words in _listed(text)}
    return dict(sorted(flat.items(), key=lambda item: -len(item[0])))


# How the words before an anchor are read; "in" may turn out to name a place.
RELATIONS: dict[Words, RelationKind] = _table(
    {
        "left of": ("on the left side of, to the left side of, to the left of, on the left of, left of, left to"),
        "right of": ("on the right side of, to the right side of, to the right of, on the right of, right of"),
        "between": ("in the middle of, in between, between"),
        "behind": ("at the back of, in the back of, in back of, behind"),
        "next to": (
            "right next to, next to, near to, close to, close by, adjacent to, nearby to, along with, "
            "together with, beside, besides, by, near, alongside, against, around, at"
        ),
        "farthest from": ("farthest away from, furthest away from, farthest from, furthest from"),
        "on": ("on top of, on, upon, atop, over, above, onto"),
        "in front of": ("in front of, opposite to, across from, before, opposite, facing"),
        "nearest to": ("nearest to, closest to, nearest, closest"),
        "in": ("inside of, in, inside, within, into, from"),
        "with": ("that has, which has, that have, with, having, holding, carrying"),
        "under": ("under, underneath, below, beneath"),
    }
)
# Where a thing is, said of the anchor: "the table with the lamp ON IT".
REVERSED: dict[Words, RelationKind] = _table(
    {
        "on": ("on top of it, on top of them, on it, on top, on them, upon it"),
        "in front of": ("in front of it"),
        "next to": ("next to it, close to it, beside it, by it, near it, at it"),
        "under": ("under it, underneath it, below it, beneath it, underneath"),
        "in": ("in it, inside it, in them, inside"),
        "behind": ("behind it"),
    }
)
NEGATIONS = _listed(
    "that is not, which is not, but not, and not, except for, but for, other than, rather than, instead "
    "of, that isn't, which isn't, that's not, anything but, is not, are not, apart from, different from, "
    "not, except, excluding, without, no, never, isn't, aren't"
)
# Between the thing and what is said of it; nothing is lost by dropping them.
FILLERS = _listed(
    "the one that is, the ones that are, that is, which is, that are, which are, who is, that was, which "
    "was, that stands, which stands, that sits, over there, the one, the ones, that lies, that's, is, "
    "are, standing, sitting, lying, located, placed, hanging, mounted, situated, leaning, resting, found, "
    "right, somewhere, directly, just, kept, laid, stored"
)
# A second wish, or a reason: told to the operator as not used.
ASIDES = _listed(
    "and then, so that, so i, so we, and take, and bring, and go, and show, and find, and come, and tell, "
    "and wait, and stop, and return, to the, to my, to our, to me, to a, and look, as soon, as fast, as "
    "quickly, before you, and get, and fetch, then, because, if, when, while, until, since, after"
)
WHICH: dict[Words, WhichKind] = _table(
    {
        "nearest": ("nearest, closest, nearby"),
        "farthest": ("farthest, furthest, most distant"),
        "largest": ("largest, biggest, longest, widest, most spacious, greatest"),
        "smallest": ("smallest, tiniest, littlest, narrowest"),
        "tallest": ("tallest, highest"),
        "lowest": ("lowest, shortest"),
        "left-most": ("leftmost, left-most, left most"),
        "right-most": ("rightmost, right-most, right most"),
        "other": ("other, another, different"),
    }
)
# Which one, said behind the thing: "the lamp on the left", "the chair near me".
SIDES: dict[Words, WhichKind] = _table(
    {
        "left-most": (
            "on the left, to the left, on the left side, on the left hand side, on my left, to my left, "
            "from the left, from left"
        ),
        "right-most": (
            "on the right, to the right, on the right side, on the right hand side, on my right, to my "
            "right, from the right, from right"
        ),
        "nearest": (
            "near me, next to me, close to me, near you, beside me, around here, near here, nearby, close by, near by"
        ),
    }
)
_ORDINALS = ("first 1st", "second 2nd", "third 3rd", "fourth 4th", "fifth 5th", "sixth 6th", "seventh 7th")
ORDINALS = {word: n for n, row in enumerate(_ORDINALS, start=1) for word in row.split()} | {"last": -1}
# Names in which such a word says nothing about which one.
COMPOUNDS = _listed(
    "first aid, second hand, second-hand, last minute, first class, other half, top hat, over bed, over- "
    "bed, no smoking, no entry, no parking, clip on, carry on, lie in, walk in, plug in, built in, stand "
    "by, pull out, roll on, on off, alarm on"
)
QUANTIFIERS = _listed("all of the, one of the, any of the, each of the, both of the, all the, all, both, every")
ARTICLES = _set("the, a, an, some, any, my, our, your, his, her, their, its, this, that, these, those")
NUMBERS = _set("two, three, four, five, six, seven, eight, nine, ten, several, many")
PRONOUNS = _set("one, ones, it, them, thing")
COLOURS = _set(
    "red, orange, yellow, green, blue, purple, violet, pink, brown, black, white, grey, gray, beige, silver, golden, "
    "gold, turquoise, teal, lime, cyan, magenta, maroon, navy"
)
SIZES = _set("big, large, small, little, tiny, huge, tall, short, long, wide, narrow, low")
