"""TRUTH.json (`openbelief.truth/1`): what is really where, and queries with the objects that answer them."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from openbelief.arrays import Array
from openbelief.documents import from_json

FORMAT = "openbelief.truth/1"
ABSENT = "absent"
BOX_MARGIN_M = 0.25  # where a truth file names none


class TruthError(ValueError):
    """The file cannot be used; the message names the file, the cause and the remedy."""


@dataclass(frozen=True)
class TrueObject:
    """aabb: (2, 3) float64, map frame, metres, min and max. colour: None where it is not told."""

    id: int
    label: str
    aabb: Array
    colour: str | None = None

    def contains(self, point: Array, margin_m: float) -> bool:
        """True inside the box grown by `margin_m`."""
        return bool((point >= self.aabb[0] - margin_m).all() and (point <= self.aabb[1] + margin_m).all())

    def horizontal_distance(self, point: Array) -> float:
        """Metres from a point to the box, seen from above; 0 inside."""
        outside = np.maximum(np.maximum(self.aabb[0, :2] - point[:2], point[:2] - self.aabb[1, :2]), 0.0)
        return float(np.hypot(*outside))


@dataclass(frozen=True)
class TrueQuery:
    """accept: ids of the objects that answer it. findable: False where perception never named the thing."""

    query: str
    kind: str
    accept: tuple[int, ...]
    findable: bool


@dataclass(frozen=True)
class Truth:
    """mask_origin: (stamp_ns, mask_index) -> the true object a mask was drawn from, where that is known.

    margin_m: a box grown by it holds a right candidate's centroid; small where things are small and close together.
    """

    objects: Mapping[int, TrueObject]
    queries: tuple[TrueQuery, ...]
    mask_origin: Mapping[tuple[int, int], int]
    absent_nouns: tuple[str, ...]
    margin_m: float = BOX_MARGIN_M


def read_truth(path: str | os.PathLike[str]) -> Truth:
    """Raises TruthError with one clear line."""
    file = Path(path)
    try:
        content = from_json(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise TruthError(f"{file} cannot be read: {error.strerror}.") from error
    except ValueError as error:
        raise TruthError(f"{file} is not JSON ({error}): give the TRUTH.json beside the recording.") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise TruthError(f"{file} is not a {FORMAT!r} file: give the TRUTH.json beside the recording.")
    try:
        return truth_of(content)
    except (KeyError, TypeError, ValueError) as error:
        raise TruthError(f"{file} does not follow {FORMAT!r}: {type(error).__name__} {error}.") from error


def truth_of(content: dict[str, Any]) -> Truth:
    """Of a document. Raises KeyError, TypeError or ValueError where it does not follow the format."""
    objects = {o.id: o for o in map(_parse_object, content["objects"])}
    queries = tuple(map(_parse_query, content["queries"]))
    if unknown := {i for q in queries for i in q.accept} - objects.keys():
        raise ValueError(f"a query accepts object {min(unknown)}, which is not among the objects")
    origin = {(int(stamp), int(mask)): int(true_id) for stamp, mask, true_id in content.get("mask_origin", [])}
    margin_m = float(content.get("margin_m", BOX_MARGIN_M))
    if not (math.isfinite(margin_m) and margin_m >= 0):
        raise ValueError(f"margin_m should be a length in metres, got {content['margin_m']!r}")
    return Truth(objects, queries, origin, tuple(content.get("absent_nouns", [])), margin_m)


def _parse_object(row: dict[str, Any]) -> TrueObject:
    aabb = np.array(row["aabb"], dtype=float)
    if aabb.shape != (2, 3) or not math.isfinite(aabb.sum()) or (aabb[0] > aabb[1]).any():
        raise ValueError(f"object {row['id']}: aabb should be [[min x, y, z], [max x, y, z]]")
    return TrueObject(int(row["id"]), str(row["label"]), aabb, row.get("colour"))


def _parse_query(row: dict[str, Any]) -> TrueQuery:
    accept = tuple(int(i) for i in row["accept"])
    if not accept and row["kind"] != ABSENT:
        raise ValueError(f"query {row['query']!r} of kind {row['kind']!r} accepts no object")
    return TrueQuery(str(row["query"]), str(row["kind"]), accept, bool(row.get("findable", True)))
