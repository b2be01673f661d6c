"""Which of the things that fit: the largest, the second, the other one, the one nearest to who asks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from openbelief.arrays import Array
from openbelief.grounded.geometry import Viewer
from openbelief.grounded.options import GroundedOptions
from openbelief.grounded.table import MapTable
from openbelief.request.request import Which

TURN_M = 3.0  # a radian away from where somebody looks is as these metres


def fitting(head: Array, allowed: Array, options: GroundedOptions) -> Array:
    """(n,) bool: the nodes whose H is at most `fit_margin` below the best that is allowed."""
    best = head[allowed].max(initial=-1.0)
    return allowed & (head >= best - options.fit_margin)


def in_order(table: MapTable, which: Which, score: Array, fits: Array, viewer: Viewer | None) -> tuple[Array, str]:
    """(n,) the score with the ones meant first, and what the operator is told, "" where it could be used.

    Things are counted, not nodes: pieces of one thing share a number. Only what fits is put in order.
    """
    things = _things(table, score, fits)
    if which.kind in BY_SHAPE:
        measure, down = BY_SHAPE[which.kind]
        things.sort(key=lambda nodes: measure(table, nodes), reverse=down)
    elif which.kind in BY_VIEWER:
        if viewer is None:
            return score, f"which one is the {which.kind} cannot be told without knowing where you are"
        seen, down = BY_VIEWER[which.kind]
        things.sort(key=lambda nodes: seen(table, nodes, viewer), reverse=down)
    number = which.number + (which.kind == "other")
    first = number - 1 if number > 0 else len(things) + number
    if not 0 <= first < len(things):
        return score, f"the map holds only {len(things)} that could be meant"
    ordered = [*things[first:], *things[:first]]
    best, out = float(score[fits].max()), score.copy()
    for rank, nodes in enumerate(ordered):
        within = np.argsort(np.argsort(-score[nodes], kind="stable"))
        out[nodes] = best + (len(ordered) - rank) - within / (len(nodes) + 1.0)
    return out, ""


def _things(table: MapTable, score: Array, fits: Array) -> list[Array]:
    """The fitting nodes of each thing, the best thing first."""
    nodes = np.flatnonzero(fits)
    nodes = nodes[np.lexsort((nodes, -score[nodes]))]
    groups: dict[int, list[int]] = {}
    for node in nodes.tolist():
        groups.setdefault(int(table.group[node]), []).append(node)
    return [np.array(members) for members in groups.values()]


def _box(table: MapTable, nodes: Array) -> tuple[Array, Array]:
    """Around all pieces of a thing, those that do not fit by themselves too."""
    pieces = table.pieces_of(int(nodes[0]))
    return table.low[pieces].min(axis=0), table.high[pieces].max(axis=0)


def _volume(table: MapTable, nodes: Array) -> float:
    low, high = _box(table, nodes)
    return float(np.prod(high - low + 0.02))


def _height(table: MapTable, nodes: Array) -> float:
    low, high = _box(table, nodes)
    return float(high[2] - low[2])


def _away(table: MapTable, nodes: Array, viewer: Viewer) -> float:
    low, high = _box(table, nodes)
    return float(np.hypot(*np.maximum(np.maximum(low[:2] - viewer.xy, viewer.xy - high[:2]), 0.0)))


def _ahead(table: MapTable, nodes: Array, viewer: Viewer) -> float:
    """How far away, and how far from straight ahead."""
    return _away(table, nodes, viewer) + TURN_M * abs(_leftness(table, nodes, viewer))


def _behind(table: MapTable, nodes: Array, viewer: Viewer) -> float:
    return _away(table, nodes, viewer) + TURN_M * (np.pi - abs(_leftness(table, nodes, viewer)))


def _leftness(table: MapTable, nodes: Array, viewer: Viewer) -> float:
    """The bearing to the left of where the viewer looks, radians in [-pi, pi)."""
    low, high = _box(table, nodes)
    x, y = (low[:2] + high[:2]) / 2 - viewer.xy
    return float((np.arctan2(y, x) - viewer.yaw + np.pi) % (2 * np.pi) - np.pi)


# What things are put in order by, and whether the largest comes first; None and "other" keep the order of the scores.
BY_SHAPE: dict[str, tuple[Callable[[MapTable, Array], float], bool]] = {
    "largest": (_volume, True),
    "smallest": (_volume, False),
    "tallest": (_height, True),
    "lowest": (_height, False),
}
BY_VIEWER: dict[str, tuple[Callable[[MapTable, Array, Viewer], float], bool]] = {
    "nearest": (_away, False),
    "farthest": (_away, True),
    "left-most": (_leftness, True),
    "right-most": (_leftness, False),
    "ahead": (_ahead, False),
    "behind": (_behind, False),
}
