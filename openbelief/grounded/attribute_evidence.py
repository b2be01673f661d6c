"""What the map's phrases say against an attribute that is asked for: "it was called gray, never red".

A phrase seldom names a colour and almost never a material: what nobody said of a thing denies nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array
from openbelief.grounded.attributes import alternatives_of, attributes_of, denies
from openbelief.grounded.table import MapTable

SAID_MAX = 3  # words of it that the operator is told


@dataclass(frozen=True, eq=False)
class AskedAttribute:
    """One kind of the attributes of a thing. agreed, denied: (n,) support of the phrases that say so, or otherwise."""

    kind: str
    words: frozenset[str]
    agreed: Array
    denied: Array

    @classmethod
    def of(cls, table: MapTable, kind: str, words: frozenset[str]) -> AskedAttribute:
        said = [attributes_of(phrase).get(kind, frozenset()) for phrase in table.words]
        against = np.array([denies(kind, each, words) for each in said], dtype=bool)
        told = np.array([bool(each) for each in said], dtype=bool)
        support = (table.of_rows(table.support * mask[table.phrase]) for mask in (told & ~against, against))
        return cls(kind, words, *support)

    @property
    def contradicted(self) -> Array:
        """(n,) the share of what is said of it that denies it; 0 where nothing is said."""
        return self.denied / np.maximum(self.agreed + self.denied, 1e-12)

    @property
    def asked(self) -> str:
        return " and ".join(sorted(self.words))


@dataclass(frozen=True, eq=False)
class AttributeEvidence:
    """Of a thing, or of several alternatives of which one will do: the asked attributes of each."""

    table: MapTable
    alternatives: Sequence[Sequence[AskedAttribute]]

    @classmethod
    def of(cls, table: MapTable, text: str) -> AttributeEvidence:
        asked = map(attributes_of, alternatives_of(text))
        return cls(table, [[AskedAttribute.of(table, kind, words) for kind, words in one.items()] for one in asked])

    @property
    def contradicted(self) -> Array:
        """(n,) in [0, 1], of the attribute that is most denied, of the alternative that is least."""
        return np.min([_most_denied(one, len(self.table)) for one in self.alternatives], axis=0)

    def unsaid(self, i: int) -> list[AskedAttribute]:
        """Those of which nothing is said of node i, in the alternative that fits it best."""
        return [each for each in self._best(i) if each.agreed[i] + each.denied[i] <= 0]

    def unconfirmed(self, i: int) -> list[AskedAttribute]:
        """Those that no phrase of node i says."""
        return [each for each in self._best(i) if each.agreed[i] <= 0]

    def denial(self, i: int) -> str:
        """ "called gray and white, never red"."""
        attribute = max(self._best(i), key=lambda each: each.contradicted[i])
        said = Counter[str]()
        for entry in np.flatnonzero(self.table.row == i):
            words = attributes_of(self.table.words[self.table.phrase[entry]]).get(attribute.kind, frozenset())
            if denies(attribute.kind, words, attribute.words):
                said.update(dict.fromkeys(sorted(words), float(self.table.support[entry])))
        called = " and ".join(word for word, _ in said.most_common(SAID_MAX))
        seldom = "hardly ever" if attribute.agreed[i] > 0 else "never"
        return f"called {called}, {seldom} {attribute.asked}"

    def _best(self, i: int) -> Sequence[AskedAttribute]:
        return min(self.alternatives, key=lambda one: max((each.contradicted[i] for each in one), default=0.0))


def _most_denied(attributes: Sequence[AskedAttribute], n: int) -> Array:
    return np.max([np.zeros(n), *(each.contradicted for each in attributes)], axis=0)
