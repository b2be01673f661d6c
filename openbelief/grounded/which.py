"""Which of the things that fit: the largest, the second, the other one, the one nearest to who asks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

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
    things = Things.of(table, score, fits)
    order = np.arange(len(things))
    if which.kind in BY_SHAPE:
        measure, down = BY_SHAPE[which.kind]
        order = _sorted(measure(things), down)
    elif which.kind in BY_VIEWER:
        if viewer is None:
            return score, f"which one is the {which.kind} cannot be told without knowing where you are"
        seen, down = BY_VIEWER[which.kind]
        order = _sorted(seen(things, viewer), down)
    number = which.number + (which.kind == "other")
    first = number - 1 if number > 0 else len(things) + number
    if not 0 <= first < len(things):
        return score, f"the map holds only {len(things)} that could be meant"
    rank = np.empty(len(things), np.int64)
    rank[np.roll(order, -first)] = np.arange(len(things))
    out, thing = score.copy(), things.number
    out[things.nodes] = score[fits].max() + (len(things) - rank[thing]) - things.within / (things.size[thing] + 1.0)
    return out, ""


@dataclass(frozen=True, eq=False)
class Things:
    """The t things of k nodes that fit, the best thing and the best node first.

    nodes: (k,); number: (k,) the thing of each; within: (k,) how many nodes of its thing are before it. size: (t,).
    low, high: (t, 3) around all pieces of a thing, those that do not fit by themselves too; map frame, metres.
    """

    nodes: Array
    number: Array
    within: Array
    size: Array
    low: Array
    high: Array

    @classmethod
    def of(cls, table: MapTable, score: Array, fits: Array) -> Things:
        nodes = np.flatnonzero(fits)
        nodes = nodes[np.argsort(-score[nodes], kind="stable")]
        _, best, group = np.unique(table.group[nodes], return_index=True, return_inverse=True)
        of_group = np.empty(len(best), np.int64)
        of_group[np.argsort(best)] = np.arange(len(best))
        number = of_group[group]
        size = np.bincount(number)
        within = np.empty(len(nodes), np.int64)
        within[np.argsort(number, kind="stable")] = np.arange(len(nodes)) - np.repeat(np.cumsum(size) - size, size)
        low, high = (ends[nodes[np.sort(best)]] for ends in table.thing_boxes)
        return cls(nodes, number, within, size, low, high)

    def __len__(self) -> int:
        return len(self.size)


def _sorted(measure: Array, down: bool) -> Array:
    """(t,) the things in order; of those that are alike, the better one first."""
    return np.argsort(-measure if down else measure, kind="stable")


def _volume(things: Things) -> Array:
    return np.prod(things.high - things.low + 0.02, axis=1)


def _height(things: Things) -> Array:
    height: Array = things.high[:, 2] - things.low[:, 2]
    return height


def _away(things: Things, viewer: Viewer) -> Array:
    apart = np.maximum(np.maximum(things.low[:, :2] - viewer.xy, viewer.xy - things.high[:, :2]), 0.0)
    return np.hypot(apart[:, 0], apart[:, 1])


def _ahead(things: Things, viewer: Viewer) -> Array:
    """How far away, and how far from straight ahead."""
    return _away(things, viewer) + TURN_M * np.abs(_leftness(things, viewer))


def _behind(things: Things, viewer: Viewer) -> Array:
    return _away(things, viewer) + TURN_M * (np.pi - np.abs(_leftness(things, viewer)))


def _leftness(things: Things, viewer: Viewer) -> Array:
    """The bearing to the left of where the viewer looks, radians in [-pi, pi)."""
    x, y = ((things.low[:, :2] + things.high[:, :2]) / 2 - viewer.xy).T
    return (np.arctan2(y, x) - viewer.yaw + np.pi) % (2 * np.pi) - np.pi


# What things are put in order by, and whether the largest comes first; None and "other" keep the order of the scores.
BY_SHAPE: dict[str, tuple[Callable[[Things], Array], bool]] = {
    "largest": (_volume, True),
    "smallest": (_volume, False),
    "tallest": (_height, True),
    "lowest": (_height, False),
}
BY_VIEWER: dict[str, tuple[Callable[[Things, Viewer], Array], bool]] = {
    "nearest": (_away, False),
    "farthest": (_away, True),
    "left-most": (_leftness, True),
    "right-most": (_leftness, False),
    "ahead": (_ahead, False),
    "behind": (_behind, False),
}
