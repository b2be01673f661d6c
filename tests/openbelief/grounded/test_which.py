"""Which of the things that fit: over matrices, as thing by thing."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief.grounded.geometry import Viewer
from openbelief.grounded.table import MapTable
from openbelief.grounded.which import BY_SHAPE, BY_VIEWER, TURN_M, in_order
from openbelief.request.request import Which

VIEWER = Viewer(4.0, 5.0, 0.7)


def table_of(rng, nodes):
    """Boxes on a coarse grid, so that many are alike; a third of the nodes are pieces of things with others."""
    low = rng.integers(0, 8, (nodes, 3)).astype(float)
    nothing = np.zeros((0, 2), np.float32)
    return MapTable(
        words=(),
        colours=(),
        known={},
        vectors=nothing,
        bare_vectors=nothing,
        row=np.zeros(0, int),
        phrase=np.zeros(0, int),
        support=np.zeros(0),
        belief=np.zeros(0),
        length=np.zeros(nodes),
        bare_length=np.zeros(nodes),
        features=np.zeros((nodes, 2), np.float32),
        looks=np.ones(nodes),
        low=low,
        high=low + rng.integers(1, 3, (nodes, 3)),
        centroid=low,
        background=np.zeros(nodes, bool),
        group=rng.integers(0, max(1, 2 * nodes // 3), nodes),
    )


def box_of(table, node):
    pieces = table.group == table.group[node]
    return table.low[pieces].min(axis=0), table.high[pieces].max(axis=0)


def away(low, high):
    return float(np.hypot(*np.maximum(np.maximum(low[:2] - VIEWER.xy, VIEWER.xy - high[:2]), 0.0)))


def leftness(low, high):
    x, y = (low[:2] + high[:2]) / 2 - VIEWER.xy
    return float((np.arctan2(y, x) - VIEWER.yaw + np.pi) % (2 * np.pi) - np.pi)


# kind -> what a thing of that box is put in order by, the least first
PLAIN = {
    None: lambda low, high: 0.0,
    "largest": lambda low, high: -np.prod(high - low + 0.02),
    "smallest": lambda low, high: np.prod(high - low + 0.02),
    "tallest": lambda low, high: low[2] - high[2],
    "lowest": lambda low, high: high[2] - low[2],
    "nearest": away,
    "farthest": lambda low, high: -away(low, high),
    "left-most": lambda low, high: -leftness(low, high),
    "right-most": leftness,
    "ahead": lambda low, high: away(low, high) + TURN_M * abs(leftness(low, high)),
    "behind": lambda low, high: away(low, high) + TURN_M * (np.pi - abs(leftness(low, high))),
}


def thing_by_thing(table, which, score, fits):
    things = {}
    for node in sorted(np.flatnonzero(fits), key=lambda node: (-score[node], node)):
        things.setdefault(table.group[node], []).append(node)
    ordered = sorted(things.values(), key=lambda nodes: PLAIN[which.kind](*box_of(table, nodes[0])))
    first = which.number - 1 if which.number > 0 else len(ordered) + which.number
    if not 0 <= first < len(ordered):
        return score
    out, ordered = score.copy(), [*ordered[first:], *ordered[:first]]
    for rank, nodes in enumerate(ordered):
        for within, node in enumerate(nodes):
            out[node] = score[fits].max() + len(ordered) - rank - within / (len(nodes) + 1.0)
    return out


@pytest.mark.parametrize("kind", PLAIN)
@pytest.mark.parametrize("nodes", [1, 2, 7, 60])
def test_things_are_put_in_order_as_one_by_one(kind, nodes):
    rng = np.random.default_rng([nodes, len(str(kind))])
    for number in (1, 2, -1, 40):
        table, score = table_of(rng, nodes), rng.integers(0, 5, nodes) / 4.0
        fits = rng.random(nodes) < 0.7
        fits[rng.integers(nodes)] = True
        found, note = in_order(table, Which(kind, number), score, fits, VIEWER)
        np.testing.assert_allclose(found, thing_by_thing(table, Which(kind, number), score, fits), rtol=0, atol=1e-12)
        assert bool(note) == ("only" in note)


def test_every_kind_has_a_plain_twin():
    assert {*BY_SHAPE, *BY_VIEWER, None} == PLAIN.keys()
