"""The answer to a request: candidates with what each term added, whether it was found, and what is offered instead."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from openbelief.arrays import Array, highest
from openbelief.grounded.doubt import Verdict, judge
from openbelief.grounded.reading import Reading
from openbelief.grounded.thing import ThingScores
from openbelief.grounded.typos import did_you_mean
from openbelief.request.places import PLACES
from openbelief.retrieval import Candidate

OFFERS = 3


@dataclass(frozen=True, slots=True)
class GroundedCandidate:
    """An object and what each part of the sentence added to its score. head: H of the thing's words.

    contradicted: the share, in [0, 1], of what is said of an asked colour, size or material that is another.
    """

    object_id: int
    score: float
    visual: float | None
    head: float
    thing: float
    place: float
    relation: float
    negation: float
    which: float
    contradicted: float

    @property
    def terms(self) -> dict[str, float]:
        """What was added, by the part of the sentence."""
        return {
            "thing": self.thing,
            "place": self.place,
            "relation": self.relation,
            "not": self.negation,
            "which": self.which,
        }


@dataclass(frozen=True)
class Answer:
    """answer: "found" | "unsure" | "not found", and `because` in the operator's words ("" where found).

    candidates: best first, those excluded left out. offers: object ids of the nearest three by the thing's words alone.
    understood: what of the sentence was used, as JSON. notes: what the operator is told besides.
    """

    answer: Verdict
    because: str
    understood: dict[str, Any]
    candidates: tuple[GroundedCandidate, ...]
    offers: tuple[int, ...]
    did_you_mean: tuple[str, ...]
    notes: tuple[str, ...]


def order(reading: Reading | ThingScores, exclude: frozenset[int] = frozenset(), limit: int | None = None) -> list[int]:
    """Object ids by falling score, ties by lowest id; background and excluded ones left out."""
    ids = _askable(reading, exclude)
    return ids[highest(reading.score[ids], len(ids) if limit is None else limit)].tolist()


def _askable(reading: Reading | ThingScores, exclude: frozenset[int]) -> Array:
    """(k,) ascending ids of those that can be meant."""
    kept = np.isfinite(reading.score)
    kept[[i for i in exclude if 0 <= i < len(kept)]] = False
    return np.flatnonzero(kept)


def ranked(reading: Reading | ThingScores, exclude: frozenset[int], limit: int | None) -> list[Candidate]:
    """As the paper's readouts give them: the score, <f^v, q> and H."""
    seen = reading.visual
    return [
        Candidate(i, float(reading.score[i]), None if seen is None else float(seen[i]), float(reading.head[i]))
        for i in order(reading, exclude, limit)
    ]


def candidate(reading: Reading, i: int) -> GroundedCandidate:
    return GroundedCandidate(
        object_id=i,
        score=float(reading.score[i]),
        visual=None if reading.visual is None else float(reading.visual[i]),
        head=float(reading.head[i]),
        thing=float(reading.thing[i]),
        place=float(reading.place[i]),
        relation=float(reading.relation[i]),
        negation=float(reading.negation[i]),
        which=float(reading.which[i]),
        contradicted=float(reading.contradicted[i]),
    )


def _offered(reading: Reading, phrases: tuple[str, ...]) -> tuple[str, ...]:
    """For the thing, and for every place and anchor that the map does not hold."""
    places = (*phrases, *(room.lower() for room in reading.room_names), *(row[0] for row in PLACES))
    offers = [did_you_mean(reading.request.target, phrases), *(did_you_mean(each, places) for each in reading.misread)]
    return tuple(dict.fromkeys(offer for each in offers for offer in each))[:OFFERS]


def answer(
    reading: Reading,
    phrases: Callable[[], tuple[str, ...]],
    exclude: frozenset[int] = frozenset(),
    limit: int | None = None,
) -> Answer:
    """phrases: the memory's own, asked for only where nothing was surely found."""
    ids = order(reading, exclude, None if limit is None else max(limit, 1))
    verdict, because = judge(reading, ids[0] if ids else None)
    request = reading.request
    understood = request.as_json()
    understood["unused"] = [*understood["unused"], *reading.unused]
    return Answer(
        answer=verdict,
        because=because,
        understood=understood,
        candidates=tuple(candidate(reading, i) for i in ids[:limit]),
        offers=_nearest(reading, _askable(reading, exclude)),
        did_you_mean=() if verdict == "found" else _offered(reading, phrases()),
        notes=(*reading.notes, *reading.doubts, *(_untold(reading, ids[0]) if verdict == "found" else ())),
    )


def _untold(reading: Reading, best: int) -> list[str]:
    """What nobody said of the first candidate, though it was asked for."""
    if reading.options.contradicted_at is None:
        return []
    return [f"whether it is {one.asked} was never said" for one in reading.attributes.unsaid(best)]


def _nearest(reading: Reading, ids: Array) -> tuple[int, ...]:
    """Of (k,) ascending ids those whose words fit best, or all else where any thing would do; ties by lowest id."""
    fit = reading.score if reading.request.generic else reading.head
    return tuple(ids[highest(fit[ids], OFFERS)].tolist())
