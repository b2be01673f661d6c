"""What an operator would ask at a random site, and what answers it; and nouns of what is not there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from openbelief.arrays import Array
from sim_fakes.world.sites.catalogue import ELSEWHERE, things
from sim_fakes.world.sites.layout import Placed

# As many of each kind as the development recording has.
COUNTS = {"direct": 11, "synonym": 9, "attribute": 9, "room": 9, "confused": 7, "duplicate": 5}
RELATIONS = {"on": 8, "with": 6, "next to": 8, "nearest": 8, "between": 4}
ASKING = (
    *("take me to the {}", "where is the {}?", "find the {}", "show me the {}", "bring me to the {}", "go to the {}"),
    *("I need the {}", "can you take me to the {}, please"),
)
NEXT_TO_M, NEAREST_M, CLEARLY_M = 0.6, 2.5, 0.8  # the next of its name is further off by at least that
BETWEEN_M = 0.25  # a way over it is longer than the straight one by at most that
NEAR_ABSENT_MAX = 40

# Kinds by which people ask; nobody says "the container in the kitchen".
SPOKEN_KINDS = frozenset(
    (
        *("chair", "seat", "table", "lamp", "light", "ball", "bag", "toy", "animal", "pet", "bed", "box", "rack"),
        *("board", "cart", "picture", "screen", "clock", "ladder", "cabinet", "musical instrument", "vehicle", "shelf"),
    )
)

Query = dict[str, object]


@dataclass
class Questions:
    """unsaid: by label, the name that only an operator uses. Everything is drawn from `rng`."""

    placed: Sequence[Placed]
    unsaid: Mapping[str, str]
    rng: np.random.Generator
    _queries: list[Query] = field(default_factory=list)

    def queries(self) -> list[Query]:
        wanted = [p for p in self.placed if p.asked_for]
        by_label = _by_label(wanted)
        clear = [things_of[0] for things_of in by_label.values() if len(things_of) == 1]
        ways: dict[str, Iterable[tuple[str, list[Placed]]]] = {
            "direct": ((p.label, self._called(p.label)) for p in clear if not p.confusion_rate),
            "synonym": ((said, self._called(said)) for label in by_label if (said := self.unsaid.get(label, ""))),
            "attribute": ((f"{p.colour} {p.label}", self._coloured(p)) for p in wanted),
            "room": (pair for p in wanted if (pair := self._in_its_room(p))),
            "confused": ((p.label, self._called(p.label)) for p in wanted if p.confusion_rate),
            "duplicate": ((label, self._called(label)) for label, same in by_label.items() if len(same) > 1),
        }
        return [query for kind, pairs in ways.items() for query in self._drawn(kind, pairs, COUNTS[kind])]

    def relations(self) -> list[Query]:
        ways = {
            "on": ((f"{p.label} on the {s.label}", self._standing_on(p, s)) for p, s in self._supported()),
            "with": (pair for p, s in self._supported() if (pair := self._with(p, s))),
            "next to": self._near("next to", 0.0, NEXT_TO_M),
            "nearest": self._near("nearest to", NEXT_TO_M, NEAREST_M),
            "between": self._between(),
        }
        return [query for kind, pairs in ways.items() for query in self._drawn(kind, pairs, RELATIONS[kind])]

    def absent(self) -> list[str]:
        """LVIS nouns of elsewhere, and things of the catalogue that nothing here is called or taken for."""
        here = {word for p in self.placed for word in p.thing.words}
        near = [thing.label for thing in things().values() if here.isdisjoint(thing.names)]
        return [*(word for word in ELSEWHERE if word not in here), *near[:NEAR_ABSENT_MAX]]

    def _drawn(self, kind: str, pairs: Iterable[tuple[str, list[Placed]]], most: int) -> list[Query]:
        """At most so many, each sentence once."""
        known = {text: accepted for text, accepted in pairs if accepted}
        texts = list(known)
        chosen = [texts[i] for i in self.rng.permutation(len(texts))[:most]]
        return [
            {
                "query": str(self.rng.choice(ASKING)).format(text),
                "kind": kind,
                "accept": sorted(p.id for p in known[text]),
            }
            for text in chosen
        ]

    def _called(self, words: str) -> list[Placed]:
        return [p for p in self.placed if p.is_called(words)]

    def _coloured(self, placed: Placed) -> list[Placed]:
        return [p for p in self._called(placed.label) if p.colour == placed.colour]

    def _in_its_room(self, placed: Placed) -> tuple[str, list[Placed]] | None:
        """By its name or its kind, where that alone would not tell."""
        words = str(self.rng.choice([placed.label, *sorted(SPOKEN_KINDS.intersection(placed.thing.kinds))]))
        alike = self._called(words)
        inside = [p for p in alike if p.room == placed.room]
        return (f"{words} in the {placed.room}", inside) if len(inside) < len(alike) else None

    def _supported(self) -> list[tuple[Placed, Placed]]:
        by_id = {p.id: p for p in self.placed}
        return [(p, by_id[p.on]) for p in self.placed if p.on is not None]

    def _standing_on(self, placed: Placed, support: Placed) -> list[Placed]:
        return [p for p, s in self._supported() if p.label == placed.label and s.is_called(support.label)]

    def _with(self, placed: Placed, support: Placed) -> tuple[str, list[Placed]] | None:
        if len(self._called(placed.label)) > 1 or len(self._called(support.label)) == 1:
            return None
        return f"{support.label} with the {placed.label} on it", [support]

    def _near(self, said: str, least_m: float, most_m: float) -> Iterable[tuple[str, list[Placed]]]:
        """The one of several that is clearly nearest to a thing of which there is one."""
        alone = [p for p in self.placed if len(self._called(p.label)) == 1]
        wanted = [p for p in self.placed if p.asked_for]
        kinds = sorted({word for p in wanted for word in (p.label, *SPOKEN_KINDS.intersection(p.thing.kinds))})
        for words in kinds:
            alike = self._called(words)
            for anchor in alone if len(alike) > 1 else ():
                if anchor in alike:
                    continue
                apart = sorted(((_gap(p.aabb, anchor.aabb), p) for p in alike), key=lambda pair: pair[0])
                if least_m <= apart[0][0] < most_m and apart[1][0] > apart[0][0] + CLEARLY_M:
                    yield f"{words} {said} the {anchor.label}", [apart[0][1]]

    def _between(self) -> Iterable[tuple[str, list[Placed]]]:
        alone = [p for p in self.placed if len(self._called(p.label)) == 1 and p.on is None]
        for i, a in enumerate(alone):
            for b in alone[i + 1 :]:
                if a.room != b.room or _gap(a.aabb, b.aabb) > 3.0:
                    continue
                for p in self.placed:
                    alike = self._called(p.label)
                    if p.room != a.room or len(alike) < 2 or p in (a, b) or p.on is not None or not p.asked_for:
                        continue
                    detours = sorted(_detour(q.aabb, a.aabb, b.aabb) for q in alike)
                    if _detour(p.aabb, a.aabb, b.aabb) == detours[0] < BETWEEN_M and detours[1] > CLEARLY_M:
                        yield f"{p.label} between the {a.label} and the {b.label}", [p]


def unsaid_names(placed: Sequence[Placed], rng: np.random.Generator) -> dict[str, str]:
    """By label, one of its further names, which perception at this site never says."""
    named = {p.label: p.thing.names for p in placed if p.asked_for and len(p.thing.names) > 1}
    return {label: str(rng.choice(named[label][1:])) for label in sorted(named)}


def _by_label(placed: Sequence[Placed]) -> dict[str, list[Placed]]:
    grouped: dict[str, list[Placed]] = {}
    for p in placed:
        grouped.setdefault(p.label, []).append(p)
    return grouped


def _gap(a: Array, b: Array) -> float:
    return float(np.linalg.norm(np.maximum(np.maximum(a[0] - b[1], b[0] - a[1]), 0.0)))


def _detour(p: Array, a: Array, b: Array) -> float:
    """Seen from above, between the middles."""
    at, start, end = (box.mean(axis=0)[:2] for box in (p, a, b))
    return float(np.linalg.norm(at - start) + np.linalg.norm(at - end) - np.linalg.norm(start - end))
