"""The words of one part of a request, put right."""

from __future__ import annotations

from dataclasses import replace

from openbelief.request import words as w
from openbelief.request.cursor import bare
from openbelief.request.request import Negation
from openbelief.request.words import RelationKind

PURPOSE = frozenset(("to", "can", "could", "for"))
DANGLING = (*w.RELATIONS, ("of",), ("and",), ("or",))


def without_dangling(thing: list[str]) -> tuple[list[str], list[str]]:
    """ "the chair NEXT TO", and nothing behind it: second. "something to sit ON" is what it is for."""
    for entry in DANGLING:
        before = thing[: -len(entry)]
        if before and tuple(thing[-len(entry) :]) == entry and PURPOSE.isdisjoint(before):
            kept, dangling = without_dangling(before)
            return kept, [*dangling, *entry]
    return thing, []


def adjectives_first(thing: list[str]) -> list[str]:
    """ "chair, blue" is a blue chair."""
    end = len(thing)
    while end > 1 and thing[0] not in w.GENERIC and thing[end - 1] in w.ADJECTIVES and thing[end - 2] != "or":
        end -= 1
    return [*thing[end:], *thing[:end]]


def beyond_its_kind(negation: Negation, thing: list[str]) -> Negation:
    """ "not the LAMP on the desk", of lamps: all of it is said by where it is."""
    where = negation.place or negation.relation
    return replace(negation, phrase=None) if where and negation.phrase == " ".join(thing) else negation


def anchors_of(kind: RelationKind, anchor: list[str]) -> tuple[str, ...]:
    if kind != "between" or "and" not in anchor:
        return (" ".join(anchor),)
    split = anchor.index("and")
    parts = (bare(anchor[:split]), bare(anchor[split + 1 :]))
    return tuple(" ".join(part) for part in parts if part)
