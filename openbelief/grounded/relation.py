"""How well each object stands where the sentence says, by the boxes of the objects that may be meant.

The value of node i is sum_a P_a nearness(i, a) over the anchors a, P = softmax(S_anchor / T): every object that may
be "the sofa" counts as far as it may be.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array, highest
from openbelief.grounded.geometry import ObjectBoxes, Viewer, nearness
from openbelief.grounded.options import GroundedOptions
from openbelief.grounded.table import MapTable
from openbelief.grounded.thing import ThingScores
from openbelief.phrase import is_background
from openbelief.request.request import Relation
from openbelief.request.words import RelationKind

ANCHORS_MAX = 24  # the most likely ones; what is left out would weigh nothing
LEAST_SHARE = 1e-3

ScoresOf = Callable[[str], ThingScores]


@dataclass(frozen=True, eq=False)
class RelationScores:
    """value: (n,) in [0, 1], what is expected over the anchors. holds: (n,) in [0, 1], to the anchor to which it holds
    best. anchor_heads: the best H among the candidates for each anchor, in their order.
    """

    value: Array
    holds: Array
    anchor_heads: tuple[float, ...]


def relation_scores(
    table: MapTable, relation: Relation, of: ScoresOf, viewer: Viewer | None, options: GroundedOptions
) -> RelationScores:
    """of: the scores of an anchor's words. viewer: who looks, for left, right, in front of and behind."""
    boxes = ObjectBoxes.of(table)
    likely = [_likely(table, relation, anchor, of, viewer, options) for anchor in relation.anchors]
    heads = tuple(_best_head(table, anchor, of) for anchor in relation.anchors)
    if relation.kind == "between":
        return RelationScores(*_between(boxes, likely, options), heads)
    kind, held = _meant(relation)
    value, holds = np.zeros(len(table)), np.zeros(len(table))
    for anchor, share in likely[0]:
        near = nearness(boxes, kind, anchor, held, viewer, options)
        near[table.group == table.group[anchor]] = 0.0  # nothing stands next to itself
        value += share * near
        holds = np.maximum(holds, near)
    if kind in ("nearest to", "farthest from"):  # however far: some one always is
        holds = np.ones(len(table))
    return RelationScores(np.clip(value, 0.0, 1.0), holds, heads)


def _meant(relation: Relation) -> tuple[RelationKind, bool]:
    """The geometry of a relation, and whether the anchor is what stands there ("the desk WITH the lamp ON it")."""
    if relation.kind != "with":
        return relation.kind, False
    return relation.holds or "with", relation.holds is not None


def _likely(
    table: MapTable,
    relation: Relation,
    anchor: str,
    of: ScoresOf,
    viewer: Viewer | None,
    options: GroundedOptions,
) -> list[tuple[int, float]]:
    """The nodes that may be the anchor, each with its share."""
    scores = of(anchor).score
    if relation.of_anchor is not None:
        told = relation_scores(table, relation.of_anchor, of, viewer, options).value
        scores = scores + options.relation_weight * np.log(options.relation_floor + told)
    scores = np.where(table.background & (not is_background(anchor)), -np.inf, scores)
    if not np.isfinite(scores).any():
        return []
    best = highest(scores, ANCHORS_MAX)
    weights = np.exp((scores[best] - scores[best[0]]) / options.anchor_temperature)
    shares = weights / np.exp((scores - scores[best[0]]) / options.anchor_temperature).sum()
    return [(int(i), float(share)) for i, share in zip(best, shares, strict=True) if share >= LEAST_SHARE]


def _best_head(table: MapTable, anchor: str, of: ScoresOf) -> float:
    head = np.where(table.background & (not is_background(anchor)), -1.0, of(anchor).head)
    return float(head.max(initial=-1.0))


def _between(
    boxes: ObjectBoxes, likely: list[list[tuple[int, float]]], options: GroundedOptions
) -> tuple[Array, Array]:
    """exp(-detour / scale) of the way from one anchor over the node to the other, seen from above.

    First what is expected over all pairs of anchors, then the best pair's.
    """
    value, holds = np.zeros(len(boxes.low)), np.zeros(len(boxes.low))
    pairs = [(a, b, p * q) for a, p in likely[0] for b, q in likely[-1] if a != b]
    for a, b, share in sorted(pairs, key=lambda pair: -pair[2])[:ANCHORS_MAX]:
        to_a, to_b = (np.linalg.norm(boxes.middle[:, :2] - boxes.middle[i, :2], axis=1) for i in (a, b))
        detour = to_a + to_b - np.linalg.norm(boxes.middle[a, :2] - boxes.middle[b, :2])
        near = np.exp(-detour / options.between_m)
        near[[a, b]] = 0.0
        value += share * near
        holds = np.maximum(holds, near)
    return np.clip(value, 0.0, 1.0), holds
