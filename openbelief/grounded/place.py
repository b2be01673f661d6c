"""Where the sentence says: given rooms decide, derived rooms and what stands around an object only weigh."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.grounded.geometry import Viewer
from openbelief.grounded.options import GroundedOptions
from openbelief.grounded.place_hints import HINTS
from openbelief.grounded.table import MapTable
from openbelief.grounded.thing import standardised
from openbelief.polygon import inside
from openbelief.request.encoded import EncodedRequest
from openbelief.request.other_languages import kind_abroad
from openbelief.request.places import kind_of_place
from openbelief.rooms import Room

CELL_M, CELLS_MAX = 0.5, 4_000_000
LEAST_SPREAD = 1e-6  # of the place scores over the map
REACH = 3.0  # standard deviations
STOREY_M = 3.0  # things of another storey say nothing about a room


@dataclass(frozen=True, eq=False)
class PlaceScores:
    """score: (n,) the term. inside: (n,) in [0, 1], how much each node is there. known: False where it says nothing.

    outlined: whether a room, given or derived, says where the place ends.
    note: what the operator is told about the place, "" where there is nothing to tell.
    """

    score: Array
    inside: Array
    known: bool = True
    note: str = ""
    outlined: bool = False


def place_scores(
    table: MapTable, rooms: Sequence[Room], place: str, inferred: Callable[[], Array], options: GroundedOptions
) -> PlaceScores:
    """0 inside and -given_weight outside a given room; without given rooms a log-probability of the kind of place.

    inferred: `inferred_places`, asked for only where no room was given. "the kitchen or the office": either will do.
    """
    if " or " in place:
        either = [place_scores(table, rooms, one, inferred, options) for one in place.split(" or ")]
        return _either([one for one in either if one.known] or either)
    given = [room for room in rooms if room.given]
    if given:
        return _in_given(table, given, place, options)
    kind = kind_of_place(place)
    derived = [room for room in rooms if _means(room.name, place)]
    if kind is None and not derived:
        note = f"where {place!r} is cannot be told from what stands there: give the memory rooms"
        return PlaceScores(np.zeros(len(table)), np.ones(len(table)), False, note)
    return _soft(table, derived, kind, inferred, options)


def _either(places: Sequence[PlaceScores]) -> PlaceScores:
    score, within = (np.max([getattr(one, part) for one in places], axis=0) for part in ("score", "inside"))
    return PlaceScores(score, within, places[0].known, places[0].note, any(one.outlined for one in places))


def _soft(
    table: MapTable, derived: Sequence[Room], kind: str | None, inferred: Callable[[], Array], options: GroundedOptions
) -> PlaceScores:
    score, likely = np.zeros(len(table)), np.zeros(len(table))
    if kind is not None:
        likely = np.exp(inferred()[list(HINTS).index(kind)])
        score = options.inferred_weight * np.log(options.place_floor + likely)
    if derived:
        within = _contained(table.centroid, derived, options.room_slack_m)
        score, likely = score + options.derived_weight * (within - 1.0), np.maximum(likely, within)
    return PlaceScores(score, likely, outlined=bool(derived))


def place_around(
    table: MapTable, rooms: Sequence[Room], place: str, viewer: Viewer | None, options: GroundedOptions
) -> PlaceScores:
    """The room in which the one who asks stands."""
    around = [room for room in rooms if viewer is not None and bool(inside(viewer.xy[None], room.polygon_xy)[0])]
    if not around:
        note = f"where {place!r} is cannot be told without knowing which room you are in"
        return PlaceScores(np.zeros(len(table)), np.ones(len(table)), False, note)
    held = _contained(table.centroid, around, options.room_slack_m)
    weight = options.given_weight if around[0].given else options.derived_weight
    return PlaceScores(weight * (held - 1.0), held, outlined=True)


def is_room_of(rooms: Sequence[Room], place: str) -> bool:
    """Whether some room goes by this name."""
    return any(_means(room.name, place) for room in rooms)


def _in_given(table: MapTable, rooms: Sequence[Room], place: str, options: GroundedOptions) -> PlaceScores:
    meant = [room for room in rooms if _means(room.name, place)]
    if not meant:
        names = ", ".join(dict.fromkeys(room.name for room in rooms))
        note = f"there is no room called {place!r}; the rooms are {names}"
        return PlaceScores(np.zeros(len(table)), np.ones(len(table)), False, note)
    within = _contained(table.centroid, meant, 0.0)
    elsewhere = _contained(table.centroid, [room for room in rooms if room not in meant], 0.0)
    beside = _contained(table.centroid, meant, options.room_slack_m) * (1.0 - elsewhere)
    held = np.maximum(within, beside)
    return PlaceScores(options.given_weight * (held - 1.0), held, outlined=True)


def _means(room: str, place: str) -> bool:
    """ "bedroom 2" is a bedroom, "the corridor" a hallway, "Küche" a kitchen."""
    name, asked = room.lower(), place.lower()
    kind = kind_of_place(asked)
    shorter = name.rstrip(" 0123456789.-#")
    kinds = (kind_of_place(shorter), kind_abroad(shorter))
    return name == asked or shorter == asked or (kind is not None and kind in kinds)


def _contained(points: Array, rooms: Sequence[Room], slack_m: float) -> Array:
    """(n,) 1.0 where a room holds the point, or the point moved by the slack to any of four sides."""
    held = np.zeros(len(points))
    moves = [(0.0, 0.0)] if slack_m == 0 else [(slack_m, 0.0), (-slack_m, 0.0), (0.0, slack_m), (0.0, -slack_m)]
    for room in rooms:
        low, high = room.heights_m or (-np.inf, np.inf)
        there = (points[:, 2] >= low) & (points[:, 2] < high)
        for move in moves:
            held = np.maximum(held, there & inside(points[:, :2] + np.array(move), room.polygon_xy))
    return held


def inferred_places(table: MapTable, asked: EncodedRequest, options: GroundedOptions) -> Array:
    """(places, n) log-softmax over the kinds of place of the standardised T log sum_j K_ij exp(a_j / T).

    a_j: the likeness of node j's consensus to the most typical thing of the place. K: Gaussian of the distance seen
    from above, on cells, so that the work is linear in the map.
    """
    T = options.place_temperature
    asked.of([thing for things in HINTS.values() for thing in things])  # at once: a third of the time
    likeness = _most_like(table, [asked.of(things) for things in HINTS.values()])
    counted = table.spoken & ~table.background
    weighed = np.exp(likeness / T) * counted
    spread = _spread_out(table.centroid, weighed, options.place_radius_m)
    logs = T * np.log(spread + 1e-12)
    logs = np.stack([standardised(place, ~table.background, LEAST_SPREAD) for place in logs])
    logs -= logs.max(axis=0)
    return logs - np.log(np.exp(logs).sum(axis=0))


def _most_like(table: MapTable, places: Sequence[Array]) -> Array:
    """(places, n) the best cosine of each node's consensus with one of the (k, d) things of each place."""
    alike = np.concatenate([table.bare_vectors @ things.T.astype(np.float32) for things in places], axis=1)
    first = np.cumsum([0, *map(len, places[:-1])])
    best = np.full((len(places), len(table)), -1.0)
    for nodes, sums in table.believed(alike.astype(np.float64)):
        best[:, nodes] = np.maximum.reduceat(sums, first, axis=1).T
    cosine = np.divide(best, table.bare_length, out=np.full(best.shape, -1.0), where=table.spoken)
    return np.maximum(cosine, -1.0)


def _spread_out(points: Array, values: Array, radius_m: float) -> Array:
    """(k, n) values summed over all points of a storey with a Gaussian of the distance, at each point."""
    if not len(points):
        return values
    cell = CELL_M
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    while np.prod((high - low) / cell + 1) > CELLS_MAX:
        cell *= 2
    kernel = _gaussian(radius_m / cell)
    rows, columns = (np.floor((high - low) / cell).astype(int) + 1).tolist()
    at = np.floor((points[:, :2] - low) / cell).astype(int) @ [columns, 1]
    out = np.empty_like(values)
    for mine in _storeys(points[:, 2]):
        cells = at[mine]
        for value, spread in zip(values, out, strict=True):
            grid = np.bincount(cells, weights=value[mine], minlength=rows * columns).reshape(rows, columns)
            smooth = cv2.sepFilter2D(grid, cv2.CV_64F, kernel, kernel, borderType=cv2.BORDER_CONSTANT)
            spread[mine] = smooth.ravel()[cells]
    return out


def _storeys(heights_m: Array) -> list[Array]:
    """The rows of each storey."""
    storey = np.floor((heights_m - heights_m.min()) / STOREY_M)
    order = np.argsort(storey, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(storey[order])) + 1)


def _gaussian(cells: float) -> Array:
    """(2 r + 1,) weights of sum 1, cut off at three standard deviations of so many cells."""
    away = np.arange(int(REACH * cells + 0.5) + 1)
    half = np.exp(-0.5 * (away / cells) ** 2)
    weights = np.concatenate((half[:0:-1], half))
    return weights / weights.sum()
