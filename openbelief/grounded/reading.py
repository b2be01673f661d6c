"""What the readout `grounded` makes of a request: every term, over the whole map, and what is told besides."""

from __future__ import annotations

from dataclasses import dataclass

from openbelief.arrays import Array
from openbelief.grounded.attribute_evidence import AttributeEvidence
from openbelief.grounded.levels import DoubtLevels
from openbelief.grounded.options import GroundedOptions
from openbelief.request.request import Request


@dataclass(frozen=True, eq=False)
class Reading:
    """What a request comes to over the whole map. Arrays are (n,), in the order of the objects.

    score: the sum of the terms; -inf where a node cannot be meant (background). head, visual: the thing's H and
    <f^v, q>. thing, place, relation, negation, which: the terms. fulfilled: how far the relations hold, 1 without any.
    inside: how far each node is in the place, 1 without one. attributes: what is said of each node of the asked colour,
    size or material; contradicted: the share that denies it, 0 where the options do not heed it. notes: what the
    operator is told. doubts: what keeps the answer from being sure. unused: words that could not be used, beside the
    request's own. misread: places and anchors that the map does not hold; they may be misspelt. room_names: of the
    memory's rooms. anchors: the best H of each.
    place_known, place_given, place_outlined: whether the asked place says anything, whether by rooms that a person
    gave, and whether by rooms at all.
    """

    request: Request
    score: Array
    head: Array
    visual: Array | None
    thing: Array
    place: Array
    relation: Array
    negation: Array
    which: Array
    fulfilled: Array
    inside: Array
    attributes: AttributeEvidence
    contradicted: Array
    notes: tuple[str, ...]
    doubts: tuple[str, ...]
    unused: tuple[str, ...]
    misread: tuple[str, ...]
    room_names: tuple[str, ...]
    anchors: tuple[tuple[str, float], ...]
    place_known: bool
    place_given: bool
    place_outlined: bool
    options: GroundedOptions
    levels: DoubtLevels
