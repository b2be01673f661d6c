"""What an operator asked for, in parts: the thing, where it is, which one, what it is not, what could not be used."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

from openbelief.request.words import RelationKind, WhichKind


@dataclass(frozen=True, slots=True)
class Relation:
    """Where the thing is, told by one or two others.

    holds: how a "with" relates ("the desk with the lamp ON it"). of_anchor: which anchor is meant ("the chair next to
    the table WITH THE LAMP").
    """

    kind: RelationKind
    anchors: tuple[str, ...]
    holds: RelationKind | None = None
    of_anchor: Relation | None = None

    def __str__(self) -> str:
        said = f"{self.kind} {' and '.join(self.anchors)}"
        said = f"{said} {self.holds} it" if self.holds else said
        return f"{said} {self.of_anchor}" if self.of_anchor else said


@dataclass(frozen=True, slots=True)
class Which:
    """Which of several. number counts from 1 in that order, -1 is the last; kind None counts from the best fit."""

    kind: WhichKind | None = None
    number: int = 1

    def __str__(self) -> str:
        ordinal = {1: "", 2: "second", 3: "third", -1: "last"}.get(self.number, f"number {self.number}")
        return " ".join(word for word in (ordinal, self.kind or "") if word) or "first"


@dataclass(frozen=True, slots=True)
class Negation:
    """What it is not: a phrase ("red chair"), a place, a relation; where several are given, all of them together."""

    phrase: str | None = None
    place: str | None = None
    relation: Relation | None = None

    def __str__(self) -> str:
        parts = (self.phrase, f"in {self.place}" if self.place else None, str(self.relation) if self.relation else None)
        return " ".join(part for part in parts if part)


@dataclass(frozen=True, slots=True)
class Request:
    """A sentence, understood. It never changes; what a memory makes of it is found out at read time.

    sentence: unchanged, as it was said. text: what the paper's readouts embed (its target phrase, place words
    included). target: the thing's own words. generic: the thing is not named ("something on the table"). unused: words
    that say something and cannot be used, in their order.
    """

    sentence: str
    text: str
    target: str
    place: str | None = None
    relations: tuple[Relation, ...] = ()
    which: Which | None = None
    negations: tuple[Negation, ...] = ()
    unused: tuple[str, ...] = ()
    generic: bool = False

    @property
    def phrases(self) -> tuple[str, ...]:
        """Everything that has to be embedded to answer it, once each: the thing, the anchors, what it is not."""
        of_anchors = [a for r in self.every_relation for a in r.anchors]
        of_negations = [n.phrase for n in self.negations if n.phrase]
        return tuple(dict.fromkeys([self.text, self.target, *of_anchors, *of_negations]))

    @property
    def every_relation(self) -> tuple[Relation, ...]:
        own = [*self.relations, *(n.relation for n in self.negations if n.relation)]
        return (*own, *(r.of_anchor for r in own if r.of_anchor))

    def with_place(self, place: str, without: Relation) -> Request:
        """ "in X", where X turned out to be a room."""
        return replace(self, place=place, relations=tuple(r for r in self.relations if r is not without))

    def described_by(self, relation: Relation) -> Request:
        """ "a mug with a flower pattern": where the map holds no such anchor, it describes the thing itself."""
        rest = tuple(r for r in self.relations if r is not relation)
        said = re.search(rf"\bwith (?:\S+ )?{re.escape(relation.anchors[0])}", self.text)
        words = said.group() if said else f"with {relation.anchors[0]}"  # "with a flower pattern", as it was said
        return replace(self, target=f"{self.target} {words}", relations=rest)

    def as_json(self) -> dict[str, Any]:
        """`understood` of `query --json` and of a trial (DESIGN.md)."""
        return {
            "target": self.target,
            "place": self.place,
            "relation": "; ".join(map(str, self.relations)) or None,
            "which": None if self.which is None else str(self.which),
            "not": "; ".join(map(str, self.negations)) or None,
            "unused": list(self.unused),
        }
