"""Answers at a site that nobody has tuned for: the paper's consensus and `grounded`, without rooms and with them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from openbelief.derived_rooms import with_derived_rooms
from openbelief.evaluation.retrieval import evaluate
from openbelief.evaluation.rooms import evaluate_rooms
from openbelief.evaluation.statistics import wilson
from openbelief.evaluation.truth import Truth
from openbelief.memory import ObjectMemory
from openbelief.rooms import Room

# What is told of a site: which questions, by which readout, with the rooms given or not, and which rate.
COLUMNS: dict[str, tuple[str, str, bool, str]] = {
    "consensus": ("queries", "consensus", False, "sr_at_1m"),
    "grounded": ("queries", "grounded", False, "sr_at_1m"),
    "grounded_rooms": ("queries", "grounded", True, "sr_at_1m"),
    "kept": ("queries", "grounded", False, "kept"),
    "refused": ("queries", "grounded", False, "refused"),
    "own_colour": ("queries", "grounded", False, "own_colour"),
    "other_colour": ("queries", "grounded", False, "other_colour"),
    "relations_consensus": ("relations", "consensus", False, "r_at_1"),
    "relations": ("relations", "grounded", False, "r_at_1"),
}


# And how its rooms are found on its map, where none is given: which things are in the right one, which names are right.
ROOM_COLUMNS = ("in_right_room", "rooms_named")


def evaluate_site(memory: ObjectMemory, rooms: Sequence[Room], truth: Truth, relations: Truth) -> dict[str, Any]:
    """memory: without rooms, with a map. By column {"right", "of"}; by_kind: SR@1m of grounded without rooms; misses
    likewise."""
    runs: dict[tuple[str, str, bool], dict[str, Any]] = {}
    for questions, readout, with_rooms, _ in COLUMNS.values():
        key = (questions, readout, with_rooms)
        if key not in runs:
            asked = memory.with_rooms(rooms) if with_rooms else memory
            runs[key] = evaluate(asked, truth if questions == "queries" else relations, readout)
    counts = {name: _count(runs[(q, readout, given)], rate) for name, (q, readout, given, rate) in COLUMNS.items()}
    plain = runs["queries", "grounded", False]
    kinds = {kind: _count(rates, "sr_at_1m") for kind, rates in plain["by_kind"].items()}
    missed = [*plain["misses"], *runs["relations", "grounded", False]["misses"]]
    misses = [{"query": miss["query"], "kind": miss["kind"], "instead": _first(miss)} for miss in missed]
    counts |= _rooms_found(memory, rooms, truth)
    return {"objects": len(truth.objects), "nodes": len(memory.objects), **counts, "by_kind": kinds, "misses": misses}


def _rooms_found(memory: ObjectMemory, rooms: Sequence[Room], truth: Truth) -> dict[str, dict[str, int]]:
    found = evaluate_rooms(with_derived_rooms(memory), rooms, truth.objects)
    right = found["objects"] - len(found["wrong"])
    counts = {"right": right, "of": found["objects"]}, {"right": found["named"]["right"], "of": found["rooms"]}
    return dict(zip(ROOM_COLUMNS, counts, strict=True))


def summed(sites: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Over all sites, by column: right, of, rate and its 95 % Wilson interval; the same by kind of query."""
    kinds = sorted({kind for site in sites for kind in site["by_kind"]})
    by_kind = {kind: _rate([s["by_kind"][kind] for s in sites if kind in s["by_kind"]]) for kind in kinds}
    return {**{name: _rate([site[name] for site in sites]) for name in (*COLUMNS, *ROOM_COLUMNS)}, "by_kind": by_kind}


def _rate(counts: Sequence[dict[str, int]]) -> dict[str, Any]:
    right, of = (sum(count[key] for count in counts) for key in ("right", "of"))
    return {"right": right, "of": of, "rate": right / of, "interval": list(wilson(right, of))}


def _count(result: dict[str, Any], rate: str) -> dict[str, int]:
    where = {
        "refused": ("absent_nouns", "refused", "queries"),
        "own_colour": ("colours", "kept", "queries"),
        "other_colour": ("colours", "refused", "others"),
    }
    if rate in where:
        part, share, of = where[rate]
        told = result[part]
        return {"right": round(told[share] * told[of]), "of": told[of]}
    return {"right": round(result[rate] * result["queries"]), "of": result["queries"]}


def _first(miss: dict[str, Any]) -> str | None:
    return miss["candidates"][0]["label"] if miss["candidates"] else None
