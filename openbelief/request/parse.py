"""The one parser: an operator's sentence to a Request.

    thing   [which] words                      "the second red chair"
    clause  in PLACE | RELATION anchor | not ...  "in the kitchen", "next to the sofa", "but not the blue one"
    aside   and then ..., because ...           reported as unused

The sentence is read once from left to right. Whatever begins no clause belongs to the thing, so an unknown word is
compared with the map rather than lost, and a noun of another language is as good as an English one.
"""

from __future__ import annotations

import re

from openbelief.request import words as w
from openbelief.request.clauses import Clauses
from openbelief.request.rephrase import REFUSED, rephrased, without_distance
from openbelief.request.request import Request
from openbelief.request.sentence import EDGES, asked_for, plain
from openbelief.target_phrase import NAMES_NOTHING, target_phrase

NO_NAMES = w.EMPTY | {word for table in (w.RELATIONS, w.NEGATIONS, w.LACKS) for entry in table for word in entry}
NO_NAMES -= {"top", "back", "side", "left", "right", "middle", "front", "opposite"}
BRACKETS = re.compile(r"[(\[{]([^()\[\]{}]*)[)\]}]?")
# Longest first and atomic, so that "in front of the sofa" is not read as "in" something.
_PLACED = "|".join(" ".join(entry) for entry in w.RELATIONS if entry not in (("nearest",), ("closest",)))
LEADING_PLACE = re.compile(
    rf"^(?P<where>(?>{_PLACED}) (?!me\b|you\b)[^,]+?)"
    r"(?:\s*,\s*(?=\S+ |\S+$)|\s+(?=(?:find|show|where|take|go|look|there|bring|get|something|anything|the|an?)\b))"
    r"(?P<what>(?!and\b|but\b|not\b|please\b).+)$"
)
WISHED = r"(?:(?:need|want|wanted|like|have|wish|love|got) to|let (?:me|us)|going to) "


def parse(sentence: str, before: Request | None = None) -> Request:
    """The Request of a sentence; raises ValueError where it names nothing, or is over 300 characters.

    before: the operator's last request, which "it" and "the other one" refer to.
    """
    text = target_phrase(sentence).text
    words, manner = _plain_request(sentence, text)
    said = Clauses(BRACKETS.sub(r" , \1", words).replace(",", " , ").split())
    said.read()
    target = _target(said, before)
    if target != " ".join(said.thing):
        text = target  # "other one" names nothing that a picture could be compared with
    if target in w.ARTICLES or not any(letter.isalnum() for letter in target):
        target = "something" if said.place or said.relations or said.negations or said.which else text
    if _says_nothing(target) and not (said.place or said.relations):
        raise ValueError(NAMES_NOTHING)
    return Request(
        sentence=sentence,
        text=text,
        target=target,
        place=said.place,
        relations=tuple(said.relations),
        which=said.which,
        negations=tuple(said.negations),
        unused=(*(word for word in said.unused if word not in w.ARTICLES), *manner),
        generic=_is_generic(target),
    )


def _plain_request(sentence: str, text: str) -> tuple[str, tuple[str, ...]]:
    """What is asked for in the parser's order, and what of it nothing here can heed."""
    words = rephrased(text)
    if re.search(WISHED + re.escape(text), plain(sentence)):  # "I want to sit down"
        words = f"something to {words}"
    if turned := REFUSED.match(words):
        words = f"not {turned['refused']} , the {asked_for(turned['wanted'])[0]}"
        return words, ()
    words, manner = asked_for(words)
    if turned := LEADING_PLACE.match(words):
        words = f"{asked_for(turned['what'])[0]} {turned['where']}"
    words, distance = without_distance(words)
    return words.strip(EDGES), (*distance, *manner)


def _target(said: Clauses, before: Request | None) -> str:
    """The thing's words; "one" and "it" are what was asked for before."""
    words = said.thing
    if before is None or before.generic or not words or words[-1] not in w.PRONOUNS:
        return " ".join(words)
    own = words[:-1]
    kept = [word for word in before.target.split() if not (word in w.COLOURS and w.COLOURS.intersection(own))]
    return " ".join([*own, *kept])


def _says_nothing(target: str) -> bool:
    """Whether no word of it names anything: "of", "yes", "where are"."""
    return all(word in NO_NAMES for word in target.split())


def _is_generic(target: str) -> bool:
    """ "something", "the blue one", "something small": any thing will do, of that colour."""
    words = target.split()
    named = [word for word in words if word not in w.ADJECTIVES]
    return len(named) == 1 and named[0] in w.GENERIC and named[0] in (words[0], words[-1])
