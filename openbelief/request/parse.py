"""The one parser: an operator's sentence to a Request.

    thing   [which] words                      "the second red chair"
    clause  in PLACE | RELATION anchor | not ...  "in the kitchen", "next to the sofa", "but not the blue one"
    aside   and then ..., because ...           reported as unused

The sentence is read once from left to right. Whatever begins no clause belongs to the thing, so an unknown word is
compared with the map rather than lost, and a noun of another language is as good as an English one.
"""

from __future__ import annotations

import re

from openbelief.request.clauses import Clauses
from openbelief.request.request import Request
from openbelief.request.sentence import asked_for
from openbelief.request.words import ARTICLES, PRONOUNS
from openbelief.target_phrase import target_phrase

GENERIC = frozenset(("something", "anything", "thing", "things", "object", "objects", "stuff", "item", "items", "one"))
BRACKETS = re.compile(r"[(\[{]([^()\[\]{}]*)[)\]}]?")
LEADING_PLACE = re.compile(
    r"^(?P<where>(?:in|inside|at|from|on) [^,]+?)"
    r"(?:\s*,\s*|\s+(?=(?:find|show|where|take|go|look|there|bring|get)\b))(?P<what>.+)$"
)


def parse(sentence: str, before: Request | None = None) -> Request:
    """The Request of a sentence; raises ValueError where it names nothing, or is over 300 characters.

    before: the operator's last request, which "it" and "the other one" refer to.
    """
    text = target_phrase(sentence).text
    words, manner = asked_for(text)
    if turned := LEADING_PLACE.match(words):
        words = f"{asked_for(turned['what'])[0]} {turned['where']}"
    said = Clauses(BRACKETS.sub(r" , \1", words).replace(",", " , ").split())
    said.read()
    target = " ".join(said.thing)
    if target in PRONOUNS and before is not None:
        target = before.target
    if target in ARTICLES or not any(letter.isalnum() for letter in target):
        target = "something" if said.place or said.relations or said.negations else text
    return Request(
        sentence=sentence,
        text=text,
        target=target,
        place=said.place,
        relations=tuple(said.relations),
        which=said.which,
        negations=tuple(said.negations),
        unused=(*(word for word in said.unused if word not in ARTICLES), *manner),
        generic=target in GENERIC,
    )
