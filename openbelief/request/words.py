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
    "above",
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
    "nearest",
    "farthest",
    "largest",
    "smallest",
    "tallest",
    "lowest",
    "left-most",
    "right-most",
    "ahead",
    "behind",
    "other",
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
        "left of": (
            "on the left side of, to the left side of, at the left side of, to the left of, on the left of, "
            "at the left of, left of, left to"
        ),
        "right of": (
            "on the right side of, to the right side of, at the right side of, to the right of, on the right of, "
            "at the right of, right of, right to"
        ),
        "between": ("in the middle of, in between, halfway between, between"),
        "behind": ("at the back of, in the back of, in back of, behind"),
        "next to": (
            "right next to, next to, near to, close to, close by, adjacent to, nearby to, along with, "
            "together with, not far from, not far away from, in the vicinity of, at the side of, beside, besides, by, "
            "near, alongside, against, around, at"
        ),
        "farthest from": (
            "farthest away from, furthest away from, farthest from, furthest from, a long way from, far away from, "
            "far from, away from"
        ),
        "on": ("on top of, on, upon, atop, onto"),
        "above": ("above, over"),
        "in front of": ("in front of, opposite to, across from, before, opposite, facing"),
        "nearest to": ("nearest to, closest to, nearest, closest"),
        "in": ("inside of, in, inside, within, into, from"),
        "with": ("that has, which has, that have, which have, who has, with, having, holding, carrying, containing"),
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
    "not, except, excluding, without, no, never, isn't, aren't, that does not, which does not, that doesn't, which "
    "doesn't, that do not, which do not, that don't, does not, doesn't, do not, don't, that is neither, which is "
    "neither, that's neither, neither, and nor, nor, but the, but a, but an, outside of, outside"
)
# A negation of what stands there rather than of the thing itself.
LACKS = _listed(
    "that does not have, which does not have, that doesn't have, which doesn't have, that do not have, that don't "
    "have, does not have, doesn't have, that has no, which has no, that have no, has no, have no, without, lacking"
)
# Between the thing and what is said of it; nothing is lost by dropping them.
FILLERS = _listed(
    "the one that is, the ones that are, that is, which is, that are, which are, who is, that was, which was, that "
    "stands, which stands, that sits, which sits, which lies, that hangs, which hangs, the one, the ones, that lies, "
    "that's, is, are, standing, sitting, lying, located, placed, hanging, mounted, situated, leaning, resting, found, "
    "right, somewhere, directly, just, kept, laid, stored"
)
# "does not STAND": verbs behind a negation, nouns elsewhere ("tv stand").
VERBS = _listed("stand, sit, lie, hang, be, rest, lean")
# A second wish, or a reason: told to the operator as not used.
ASIDES = _listed(
    "and then, so that, so i, so we, and take, and bring, and go, and show, and find, and come, and tell, and wait, "
    "and stop, and return, to the, to my, to our, to me, to a, and look, as soon, as fast, as quickly, quick, hurry, "
    "before you, and get, and fetch, then, because, if, when, while, until, since, after, i need, i want, i have, i "
    "am, i'm, i'd, we need, we want, we have, we are, we're, it is, it's, they are, he is, she is, he needs, she "
    "needs, there is, there's, please then, and drive, and walk, and help, and ask"
)
# Where a thing is, said without a preposition; what no room is called.
WHEREABOUTS = _listed(
    "over there, up there, down there, upstairs, downstairs, outside, outdoors, indoors, next door, over here, in "
    "here, right here, here, in there, on this floor, in this room, in the room, on the floor above, on the floor below"
)
WHICH: dict[Words, WhichKind] = _table(
    {
        "nearest": ("nearest, closest, nearby, nearer, closer"),
        "farthest": ("farthest, furthest, most distant, farther, further"),
        "largest": (
            "largest, biggest, longest, widest, most spacious, greatest, larger, bigger, longer, wider, greater"
        ),
        "smallest": ("smallest, tiniest, littlest, narrowest, smaller, tinier, narrower"),
        "tallest": ("tallest, highest, taller, higher"),
        "lowest": ("lowest, shortest, lower, shorter"),
        "left-most": ("leftmost, left-most, left most, left hand, left-hand, left"),
        "right-most": ("rightmost, right-most, right most, right hand, right-hand, right"),
        "other": ("other, another, different, next, one more, one other"),
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
_ORDINALS = (
    *("first 1st", "second 2nd", "third 3rd", "fourth 4th", "fifth 5th", "sixth 6th", "seventh 7th", "eighth 8th"),
    *("ninth 9th", "tenth 10th"),
)
ORDINALS = {word: n for n, row in enumerate(_ORDINALS, start=1) for word in row.split()} | {"last": -1, "final": -1}
# Names in which such a word says nothing about which one.
COMPOUNDS = _listed(
    "first aid, second hand, second-hand, last minute, first class, other half, top hat, over bed, over- "
    "bed, no smoking, no entry, no parking, clip on, carry on, lie in, walk in, plug in, built in, stand "
    "by, pull out, roll on, on off, alarm on"
)
QUANTIFIERS = _listed(
    "all of the, one of the, any of the, each of the, both of the, all the, all, both, every, a couple of, couple of, "
    "only, exactly one, just one, a few of the, a few of, a few, few, several of the, plenty of, lots of, a lot of, "
    "a number of, each"
)
ARTICLES = _set("the, a, an, some, any, my, our, your, his, her, their, its, this, that, these, those")
NUMBERS = _set("two, three, four, five, six, seven, eight, nine, ten, several, many")
PRONOUNS = _set("one, ones, it, them, thing")
GENERIC = PRONOUNS | _set(
    "something, anything, everything, things, object, objects, stuff, item, items, somewhere, anywhere, someplace, "
    "place, spot"
)
COLOURS = _set(
    "red, orange, yellow, green, blue, purple, violet, pink, brown, black, white, grey, gray, beige, silver, golden, "
    "gold, turquoise, teal, lime, cyan, magenta, maroon, navy"
)
SIZES = _set("big, large, small, little, tiny, huge, tall, short, long, wide, narrow, low")
ADJECTIVES = COLOURS | SIZES
SELF = _set("me, you, us, here, robot, myself, yourself")
POINTING = _set("this, that, these, those")
# Words that name nothing by themselves, beside all the tables above.
EMPTY = _set(
    "i, me, you, we, us, he, she, they, of, to, and, or, but, so, if, as, yes, yeah, no, nope, okay, ok, please, "
    "thanks, thank, hello, hi, hey, what, where, which, who, why, how, when, is, are, am, was, were, be, been, it, "
    "there, here, then, too, very, much, many, well, um, uh, er, hmm, oh, ah"
)
_TABLES = (RELATIONS, REVERSED, NEGATIONS, LACKS, FILLERS, ASIDES, WHEREABOUTS, WHICH, SIDES, COMPOUNDS, QUANTIFIERS)
# Every word of the tables: spelt right, whatever a map holds.
KNOWN = frozenset(word for table in _TABLES for entry in table for word in entry) | EMPTY | NUMBERS | ADJECTIVES
