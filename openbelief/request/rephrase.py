"""Ways to say a thing that the parser reads in another order: each is turned into the one that it knows."""

from __future__ import annotations

import re

from openbelief.request.other_languages import in_english
from openbelief.request.words import COLOURS

_COLOUR = "|".join(sorted(COLOURS))
_NUMBER = r"(?:\d+(?:[.,]\d+)?|an?|one|two|three|four|five|six|seven|eight|nine|ten|some|a few|a couple of)"
_LENGTH = rf"(?:about |only |just )?{_NUMBER} ?(?:m|cm|met(?:er|re)s?|feet|foot|steps?|yards?)"
_GO = r"(?:go|drive|walk|run|move|come|take (?:me|us)|bring (?:me|us)|lead (?:me|us)|guide (?:me|us)|show (?:me|us))"

# "don't go to the sofa, go to the armchair": what follows the comma is asked for as if it stood alone.
REFUSED = re.compile(
    rf"^(?:please )?(?:do not|don't|never) {_GO}(?: to| near)? (?P<refused>[^,]+?)"
    rf"(?: ?, ?(?:but )?| but | go | take me )(?P<wanted>.+)$"
)
DISTANCE = re.compile(rf"\b(?P<told>{_LENGTH})(?: away)? from (?=\S)")
_MAY = r"(?:can|could|may|should|do|to)"
_ONE = r"(?:i|we|you|one)"
# As people type on a phone.
_TYPED = {
    "u": "you",
    "ur": "your",
    "teh": "the",
    "wheres": "where is",
    "whats": "what is",
    "gimme": "give me",
    "lemme": "let me",
    "plz": "please",
    "pls": "please",
    "thx": "thanks",
    "goto": "go to",
    "cya": "",
}
_TURNS = (
    (re.compile(r"(?:^|(?<=\s))([a-z]+)/([a-z]+)(?=[\s,]|$)"), r"\1 or \2"),
    (re.compile(r"\b(?:preferably|ideally|either)\s+(?:an? |the )?"), ""),
    (re.compile(r"\bin (?:any|every|each|some|whichever|whatever) (?:of the )?(?:other )?rooms?\b"), ""),
    (re.compile(r"\b(?:is|are) (.+) (?:called|named)$"), r"is \1"),
    (re.compile(r"^where (in|on|at|inside|under) (?!earth\b)(.+?) (?:is|are) (.+)$"), r"\3 \1 \2"),
    (re.compile(r"^(?:which|what) room (?:is|are|has|holds) (.+?)(?: in| at)?$"), r"\1"),
    (re.compile(r"\b(?:on|to|at) (?:the )?(\S+(?: \S+)?)'s (left|right)(?: hand)?(?: side)?(?=$| ?,)"), r"\2 of \1"),
    (re.compile(r"\b(on|to|at|from) (the|my|your) (left|right)[- ]hand side\b"), r"\1 \2 \3 side"),
    (re.compile(rf"\bnon[- ]?({_COLOUR}) ([^,]+)"), r"\2 that is not \1"),
    (re.compile(rf"\b({_COLOUR})(?:[- ]colou?red|ish)\b"), r"\1"),
    (re.compile(r"\breddish\b|\bredish\b"), "red"),
    (re.compile(r"\bwhere (?:on earth|the (?:hell|heck)|exactly)\b"), "where"),
    (re.compile(rf"^where {_MAY} (?:{_ONE} )?(?!find|get|see|i |we |you )(\w.*)"), r"something to \1"),
    (re.compile(rf"^what {_MAY} {_ONE} (?:use )?(?:to )?(?!find|get|see|say|ask|do\b)(\w.*)"), r"something to \1"),
    (re.compile(rf"^(.+?) (on|in|from|with) which {_ONE} can (.+)$"), r"\1 to \3 \2"),
    (re.compile(r"^what (?:else )?(?:stands|lies|sits|hangs)\b"), "what is"),
)
STOPS = re.compile(r"\s*[;:!?\u2026]+\s*|\.\s+|\s[-\u2013\u2014]+\s")


def rephrased(words: str) -> str:
    """The same sentence with stops as commas, and in the parser's order."""
    words = in_english(" ".join(_TYPED.get(word, word) for word in words.split()))
    for pattern, instead in ((STOPS, " , "), *_TURNS):
        words = pattern.sub(instead, words)
    return " ".join(words.split())


def without_distance(words: str) -> tuple[str, tuple[str, ...]]:
    """ "two metres from the sofa" is near it; how far exactly cannot be heeded, and is told."""
    told = [word for found in DISTANCE.finditer(words) for word in found["told"].split()]
    return DISTANCE.sub("near ", words), tuple(told)
