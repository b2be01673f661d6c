"""The readout `grounded`: thing, place, relation, which one and what not, each a term of its own over the whole map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from openbelief.arrays import Array
from openbelief.grounded.attribute_evidence import AttributeEvidence
from openbelief.grounded.geometry import Viewer
from openbelief.grounded.levels import doubt_levels
from openbelief.grounded.lexicon import same
from openbelief.grounded.negation import is_phrase, penalty
from openbelief.grounded.options import GroundedOptions
from openbelief.grounded.place import PlaceScores, inferred_places, is_room_of, place_around, place_scores
from openbelief.grounded.reading import Reading
from openbelief.grounded.relation import relation_scores
from openbelief.grounded.table import MapTable
from openbelief.grounded.thing import Name, ThingScores, generic_scores, scores_of_names, thing_scores
from openbelief.grounded.typos import did_you_mean
from openbelief.grounded.which import BY_VIEWER, fitting, in_order
from openbelief.phrase import is_background
from openbelief.request.encoded import EncodedRequest
from openbelief.request.places import HERE, PLACES, is_named_place, is_place
from openbelief.request.request import Negation, Relation, Request
from openbelief.rooms import Room


class GroundedReader:
    """Reads one frozen map; what no query changes is made at the first question and kept."""

    def __init__(
        self,
        make_table: Callable[[], MapTable],
        rooms: Sequence[Room],
        text_encoder_id: str,
        options: GroundedOptions | None = None,
    ) -> None:
        self._make_table, self.rooms = make_table, tuple(rooms)
        self.options = options or GroundedOptions()
        self.levels = doubt_levels(text_encoder_id, self.options)
        self._places: Array | None = None

    @cached_property
    def table(self) -> MapTable:
        return self._make_table()

    def read(self, asked: EncodedRequest, viewer: Viewer | None = None) -> Reading:
        """viewer: where the one who asks stands, for "nearest" and "left"; None where it is not known."""
        return _Question(self, asked, viewer).reading()

    def read_vector(self, query: Array) -> ThingScores:
        """(d,) float64 unit query: the thing's term alone, over every node."""
        return scores_of_names(self.table, [Name(query, False)], self.options)

    def place(self, place: str, asked: EncodedRequest, viewer: Viewer | None = None) -> PlaceScores:
        if place in HERE and not is_room_of(self.rooms, place):
            return place_around(self.table, self.rooms, place, viewer, self.options)
        return place_scores(self.table, self.rooms, place, lambda: self._inferred(asked), self.options)

    @property
    def room_names(self) -> tuple[str, ...]:
        return tuple(room.name for room in self.rooms)

    @property
    def given_rooms(self) -> bool:
        """Whether a person said where the rooms are."""
        return any(room.given for room in self.rooms)

    def is_room(self, words: str) -> bool:
        return is_place(words) or is_room_of(self.rooms, words)

    def _inferred(self, asked: EncodedRequest) -> Array:
        if self._places is None:
            self._places = inferred_places(self.table, asked, self.options)
        return self._places


class _Question:
    """One request being read: every word is scored once, however often it is needed."""

    def __init__(self, reader: GroundedReader, asked: EncodedRequest, viewer: Viewer | None) -> None:
        self._reader, self._asked, self._viewer = reader, asked, viewer
        self._table, self._options = reader.table, reader.options
        self._known: dict[str, ThingScores] = {}
        self._notes: list[str] = []
        self._doubts: list[str] = []
        self._unused: list[str] = []
        self._misread: list[str] = []
        self._anchors: list[tuple[str, float]] = []
        self._fulfilled = np.ones(len(self._table))
        self._contradicted = np.zeros(len(self._table))

    def reading(self) -> Reading:
        request, n = self._asked.request, len(self._table)
        request = self._placed(request)
        thing = self._generic(request) if request.generic else self._of(request.target)
        allowed = np.full(n, True) if is_background(request.target) else ~self._table.background
        attributes = AttributeEvidence.of(self._table, request.target)
        if self._options.contradicted_at is not None:
            self._contradicted = attributes.contradicted
        place = self._place(request.place)
        fits = fitting(thing.head, allowed, self._options)
        standing = self._standing(place, fits)
        relation = np.sum([self._relation(one, fits) for one in request.relations], axis=0) + np.zeros(n)
        negation = np.sum([self._negation(one, request, thing) for one in request.negations], axis=0) + np.zeros(n)
        score = np.where(allowed, thing.score + standing + relation + negation, -np.inf)
        which = self._which(request, thing.head, score, negation, place.inside)
        return Reading(
            request=request,
            score=score + which,
            head=thing.head,
            visual=thing.visual,
            thing=thing.score,
            place=standing,
            relation=relation,
            negation=negation,
            which=which,
            fulfilled=self._fulfilled,
            inside=place.inside,
            attributes=attributes,
            contradicted=self._contradicted,
            notes=tuple(self._notes),
            doubts=tuple(self._doubts),
            unused=tuple(self._unused),
            misread=tuple(self._misread),
            room_names=self._reader.room_names,
            anchors=tuple(self._anchors),
            place_known=request.place is not None and place.known,
            place_given=self._reader.given_rooms,
            place_outlined=place.outlined,
            options=self._options,
            levels=self._reader.levels,
        )

    def _of(self, words: str) -> ThingScores:
        if words not in self._known:
            self._known[words] = thing_scores(self._table, words, self._asked, self._options)
        return self._known[words]

    def _is_room(self, words: str) -> bool:
        """Or meant to be one: "in the bedrom" is a room misspelt, and no thing to stand in."""
        names = (*self._reader.room_names, *(row[0] for row in PLACES))
        return self._reader.is_room(words) or bool(did_you_mean(words, map(str.lower, names)))

    def _generic(self, request: Request) -> ThingScores:
        """Every object is a thing; where nothing else is said either, any of them would do, and that is no answer."""
        if not (request.place or request.relations):
            self._doubts.append(f"{request.target!r} names no thing, and nothing is said of where it is")
        return generic_scores(self._table, request.target, self._options)

    def _placed(self, request: Request) -> Request:
        """What only the memory can tell: that "in X" names one of its rooms, that "with X" describes the thing, or
        that what is asked for is itself a room and nothing on the map is called so.
        """
        target = request.target
        room = is_named_place(target) or is_room_of(self._reader.rooms, target)
        if request.place is None and room and not self._is_called(target):
            self._doubts.append(f"{request.target!r} is a place, and a drive goes to a thing in it: name one")
            request = replace(request, place=target)
        for relation in request.relations:
            if relation.kind == "in" and request.place is None and self._is_room(relation.anchors[0]):
                request = request.with_place(relation.anchors[0], without=relation)
            elif relation.kind == "with" and relation.holds is None and not self._is_here(relation.anchors[0]):
                request = request.described_by(relation)
        return request

    def _is_called(self, words: str) -> bool:
        """Whether some phrase of the map is this word, or means the same."""
        known = set(self._table.words)
        return words in known or not known.isdisjoint(same(words))

    def _is_here(self, words: str) -> bool:
        return bool(self._of(words).head.max(initial=-1.0) >= self._reader.levels.unsure)

    def _place(self, place: str | None) -> PlaceScores:
        n = len(self._table)
        if place is None:
            return PlaceScores(np.zeros(n), np.ones(n))
        scores = self._reader.place(place, self._asked, self._viewer)
        if not scores.known:
            self._unused += place.split()
            self._misread.append(place)
            self._doubts.append(scores.note)
        return scores

    def _standing(self, place: PlaceScores, fits: Array) -> Array:
        """Rooms that nobody gave only choose among what fits: other things gain nothing by standing there."""
        if self._reader.given_rooms or not place.known:
            return place.score
        return np.where(fits, place.score, place.score.min(initial=0.0))

    def _relation(self, relation: Relation, fits: Array) -> Array:
        """log(floor + value); what does not fit the words gains nothing by standing in the right place."""
        scores = relation_scores(self._table, relation, self._of, self._viewer, self._options)
        self._anchors += zip(relation.anchors, scores.anchor_heads, strict=True)
        missing = [
            a for a, h in zip(relation.anchors, scores.anchor_heads, strict=True) if h < self._reader.levels.unsure
        ]
        if missing:
            self._unused += [word for anchor in missing for word in anchor.split()]
            self._misread += missing
            told = [f"the map holds nothing like {anchor!r}" for anchor in missing]
            (self._notes if all(map(is_background, missing)) else self._doubts).extend(told)  # walls are everywhere
            return np.zeros(len(self._table))
        self._fulfilled = np.minimum(self._fulfilled, scores.holds)
        value = np.where(fits, scores.value, 0.0)
        return self._options.relation_weight * np.log(self._options.relation_floor + value)

    def _negation(self, negation: Negation, request: Request, thing: ThingScores) -> Array:
        degree = np.ones(len(self._table))
        if negation.phrase is not None:
            degree = degree * is_phrase(self._table, negation.phrase, request.target, self._of(negation.phrase), thing)
        if negation.place is not None:
            place = self._reader.place(negation.place, self._asked, self._viewer)
            degree = degree * (place.inside if place.known else 0.0)
        if negation.relation is not None:
            degree = (
                degree * relation_scores(self._table, negation.relation, self._of, self._viewer, self._options).value
            )
        return penalty(degree, self._options)

    def _which(self, request: Request, head: Array, score: Array, negation: Array, inside: Array) -> Array:
        """What is added to put the ones meant first, among those that are not ruled out and stand in the place."""
        if request.which is None:
            return np.zeros(len(score))
        allowed = np.isfinite(score) & (negation > -self._options.not_weight / 2)
        for degree in (inside, self._fulfilled):
            allowed &= degree >= 0.5 * degree.max(initial=0.0, where=allowed)
        fits = fitting(head, allowed, self._options)
        undenied = 1.0 - self._contradicted
        fits &= undenied >= 0.5 * undenied.max(initial=0.0, where=fits)
        if not fits.any():
            self._doubts.append(
                f"which one is the {request.which} cannot be told: the map holds none that could be meant"
            )
            return np.zeros(len(score))
        ordered, note = in_order(self._table, request.which, score, fits, self._viewer)
        if note:
            (self._notes if request.which.kind in BY_VIEWER else self._doubts).append(note)
            self._unused += str(request.which).split()
        return np.subtract(ordered, score, out=np.zeros(len(score)), where=np.isfinite(score))
