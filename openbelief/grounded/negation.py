"""What it is not, as a degree in [0, 1] of each object being just that."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array
from openbelief.grounded.colours import colours_of, without_colour
from openbelief.grounded.options import GroundedOptions
from openbelief.grounded.table import MapTable
from openbelief.grounded.thing import ThingScores

SOFT = 0.03  # of H: within this of each other a node is as much the one as the other
COLOUR_PRIOR = 1.0  # evidence w_e: less than for an asked colour, for one look that says "red" is enough to pass by


def is_phrase(table: MapTable, phrase: str, thing: str, of_phrase: ThingScores, of_thing: ThingScores) -> Array:
    """How much each node is the phrase rather than the thing: by colour where only that differs, else by H."""
    colours = colours_of(phrase)
    if colours and _kind(without_colour(phrase)) == _kind(without_colour(thing)):
        return _of_colour(table, colours)
    return 1.0 / (1.0 + np.exp(-(of_phrase.head - of_thing.head + SOFT) / SOFT))


def _of_colour(table: MapTable, colours: frozenset[str]) -> Array:
    named = np.array([bool(c & colours) for c in table.colours], dtype=np.float64)[table.phrase]
    other = np.array([bool(c and not c & colours) for c in table.colours], dtype=np.float64)[table.phrase]
    told, else_told = table.of_rows(table.support * named), table.of_rows(table.support * other)
    return told / (told + else_told + COLOUR_PRIOR)


def _kind(words: str) -> str:
    return words.split()[-1].removesuffix("s")


def penalty(degree: Array, options: GroundedOptions) -> Array:
    return -options.not_weight * degree
