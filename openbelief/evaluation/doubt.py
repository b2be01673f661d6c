"""Doubt against ground truth: what is kept of things that are there, and refused of things that are not.

kept: the share of findable queries answered *found*. refused: the share of absent nouns not answered *found*. Whether
the right thing was found is R@1's question.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from openbelief.evaluation.colours import coloured_queries
from openbelief.evaluation.truth import ABSENT, Truth
from openbelief.grounded.answer import order
from openbelief.grounded.doubt import Verdict, judge
from openbelief.grounded.levels import DoubtLevels
from openbelief.grounded.reading import Reading
from openbelief.memory import ObjectMemory

SWEPT = tuple(round(0.40 + 0.025 * step, 3) for step in range(23))  # found_at of the curve
BAND = 0.10  # of unsure below found


def doubt_of(memory: ObjectMemory, truth: Truth) -> dict[str, Any]:
    """`kept`, `absent_nouns` where the truth lists some, `colours` where it tells them, and `doubt`: the levels in use
    and the curve over others.
    """
    findable = [q.query for q in truth.queries if q.kind != ABSENT and q.findable]
    here, absent = (_readings(memory, queries) for queries in (findable, truth.absent_nouns))
    result: dict[str, Any] = {"kept": _share(_verdicts(here), "found")}
    if absent:
        verdicts = _verdicts(absent)
        result["absent_nouns"] = {
            "queries": len(absent),
            "refused": 1.0 - (_share(verdicts, "found") or 0.0),
            "unsure": _share(verdicts, "unsure"),
            "not_found": _share(verdicts, "not found"),
        }
    if any(thing.colour for thing in truth.objects.values()):
        result["colours"] = _of_colours(memory, truth)
    levels = memory.reader().levels
    curve = [_point(here, absent, found_at) for found_at in SWEPT]
    return {**result, "doubt": {"found_at": levels.found, "unsure_at": levels.unsure, "curve": curve}}


def _of_colours(memory: ObjectMemory, truth: Truth) -> dict[str, Any]:
    """kept: of things asked for in their own colour. refused: of things asked for in one that none of them has."""
    own, other = coloured_queries(truth)
    kept, found = (_share(_verdicts(_readings(memory, queries)), "found") for queries in (own, other))
    refused = None if found is None else 1.0 - found
    return {"queries": len(own), "kept": kept, "others": len(other), "refused": refused}


def _readings(memory: ObjectMemory, queries: Sequence[str]) -> list[Reading]:
    return [memory.reader().read(memory.asked(query)) for query in queries] if len(memory.table) else []


def _verdicts(readings: Sequence[Reading]) -> list[Verdict]:
    ranked = ((reading, next(iter(order(reading)), None)) for reading in readings)
    return [judge(reading, best)[0] for reading, best in ranked]


def _point(here: Sequence[Reading], absent: Sequence[Reading], found_at: float) -> dict[str, float | None]:
    levels = DoubtLevels(found_at, found_at - BAND)
    kept, told = (_share(_verdicts([replace(r, levels=levels) for r in rs]), "found") for rs in (here, absent))
    return {"found_at": found_at, "kept": kept, "refused": None if told is None else 1.0 - told}


def _share(verdicts: Sequence[Verdict], one: Verdict) -> float | None:
    return float(np.mean([verdict == one for verdict in verdicts])) if verdicts else None
