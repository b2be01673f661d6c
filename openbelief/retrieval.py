"""Free-form retrieval (Sec. III-E): three language heads, reliability fusion, and the retrieval rule with exclusion.

Over a NodeTable at once: a rough pass in float32 finds who may be among the best, exact scores decide.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np

from openbelief.arrays import Array
from openbelief.node import ObjectNode
from openbelief.node_table import NodeTable
from openbelief.parameters import Parameters

Readout = Literal["consensus", "early", "belief", "grounded"]  # the paper's three, and ours (openbelief.grounded)
NOTHING_TO_COMPARE = -1.0  # the lowest cosine: a node without language whose feature is not text-aligned comes last
ROUGH = 1e-4  # a float32 cosine of unit vectors is closer to the exact one than this
BLOCK = 4096  # rows that are made float64 at once
Products: TypeAlias = Callable[[Array, Array], Array]  # (n, d) matrix, (m,) rows -> (m,) float64 products with f_q


@dataclass(frozen=True)
class Candidate:
    """An object and how well it fits a query: the fused score, and its channels (None where there is none).

    language: H_i; where features are not text-aligned, H_i as far as its node is trusted (`as_far_as_trusted`).
    """

    object_id: int
    score: float
    visual: float | None
    language: float | None


@dataclass(frozen=True)
class RetrievalQuery:
    """What a ranking is asked: f_q, (d,) float64 unit, the head, and which (N,) nodes may answer."""

    vector: Array
    readout: Readout
    asked: Array


def language_scores(table: NodeTable, objects: Array, readout: Readout, products: Products) -> Array:
    """(n,) H_i^(r)(q) of n objects (eq. retrieval-heads); NaN where K_i = 0.

    H^con = <f_i^t, f_q>; H^early = <g_ik*, f_q>, k* = argmax_k V_ik; H^bel = sum_k p_ik <g_ik, f_q>.
    """
    scores, spoken = np.full(len(objects), np.nan), table.spoken[objects]
    objects = objects[spoken]
    if readout == "consensus":
        scores[spoken] = products(table.consensus, objects)
    elif readout == "early":
        scores[spoken] = products(table.concept_embedding, table.concept_start[objects])  # by falling support
    elif len(objects):
        concepts, begin = table.concepts_of(objects)
        weighted = table.belief[concepts] * products(table.concept_embedding, concepts)
        scores[spoken] = np.add.reduceat(weighted, begin)
    return scores


def visual_weights(table: NodeTable, parameters: Parameters) -> Array:
    """(N,) lambda_i (eq. reliability-fusion)."""
    trusted = np.where(table.trusted, parameters.lambda_trusted, parameters.lambda_degraded)
    return np.where(table.spoken, trusted, parameters.lambda_no_language)


def visual_weight(node: ObjectNode, parameters: Parameters) -> float:
    """lambda_i of one node."""
    return float(visual_weights(node.table, parameters)[node.id])


def as_far_as_trusted(weights: Array, spoken: Array, asked: Array) -> Array:
    """(N,) what H_i counts where there is no visual branch for doubt to lean on: then lambda = 0, language is all.

    Degraded nodes still place less weight on language, as in eq. reliability-fusion: theirs is (1 - lambda_i) relative
    to the most trusted nodes of the map. With plain H_i one stray detection called "cup" beats 48 looks at a cup.
    """
    best = (1.0 - weights[spoken & asked]).max(initial=0.0) or 1.0
    return (1.0 - weights) / best


class NodeScores:
    """The scores of a memory's nodes for one question (eq. retrieval-score)."""

    def __init__(self, table: NodeTable, question: RetrievalQuery) -> None:
        self._table, self._question, self._parameters = table, question, table.evidence.parameters
        self._aligned = table.evidence.feature_text_aligned
        self._weights = visual_weights(table, self._parameters)
        self._factor = as_far_as_trusted(self._weights, table.spoken, question.asked)

    def best(self, exclude: frozenset[int], limit: int | None) -> list[Candidate]:
        """A_q = V_o minus R_q by falling score, ties by lowest id (eq. retrieval-rule)."""
        objects = np.flatnonzero(self._question.asked)
        if self._parameters.fusion == "calibrated":  # by all that was asked, excluded or not
            return self._candidates(objects, exclude, limit)
        objects = objects[_outside(objects, exclude)]
        if limit is not None and 0 < 4 * limit < len(objects):
            objects = self._possible(objects, limit)
        return self._candidates(objects, exclude, limit)

    def _possible(self, objects: Array, limit: int) -> Array:
        """Those of the objects that may be among the `limit` best."""
        near, _, _ = self._scores(objects, rough(self._question.vector))
        cut = np.partition(near, len(near) - limit)[len(near) - limit]
        return objects[near >= cut - 2 * ROUGH]

    def _candidates(self, objects: Array, exclude: frozenset[int], limit: int | None) -> list[Candidate]:
        fused, visual, language = self._scores(objects, exact(self._question.vector))
        order = np.lexsort((objects, -fused))
        order = order[_outside(objects[order], exclude)][:limit]
        columns = (objects[order].tolist(), fused[order].tolist(), _known(visual[order]), _known(language[order]))
        return [Candidate(*row) for row in zip(*columns, strict=True)]

    def _scores(self, objects: Array, products: Products) -> tuple[Array, Array, Array]:
        """(n,) S_i, and its channels as they are told of: <f_i^v, f_q> and H_i; NaN where there is none."""
        table, weights = self._table, self._weights[objects]
        language = language_scores(table, objects, self._question.readout, products)
        if not self._aligned:
            language = language * self._factor[objects]
            said = language if self._parameters.fusion == "paper" else standard(language)
            return np.where(np.isnan(said), NOTHING_TO_COMPARE, said), np.full(len(objects), np.nan), language
        visual = products(table.feature, objects)
        seen, said = visual, language
        if self._parameters.fusion == "calibrated":
            seen, said = standard(visual), standard(language)
        return fuse(seen, said, weights), visual, language


def standard(scores: Array) -> Array:
    """One channel as z-scores over what was asked: image-text and text-text cosines are on different scales."""
    known = scores[~np.isnan(scores)]
    spread = known.std() if len(known) else 0.0
    return (scores - known.mean()) / spread if spread > 0 else np.where(np.isnan(scores), np.nan, 0.0)


def fuse(visual: Array, language: Array, visual_weight: Array) -> Array:
    """S_i = lambda_i <f_i^v, f_q> + (1 - lambda_i) H_i (eq. retrieval-score); without language the visual score."""
    return np.where(np.isnan(language), visual, visual_weight * visual + (1.0 - visual_weight) * language)


def best_first(candidates: Sequence[Candidate]) -> list[Candidate]:
    """By falling score, ties by lowest id."""
    return sorted(candidates, key=lambda c: (-c.score, c.object_id))


def check_readout(readout: str) -> Readout:
    for known in get_args(Readout):
        if readout == known:
            return known
    raise ValueError(f"Readout should be one of {', '.join(get_args(Readout))}, got {readout!r}.")


def rough(query: Array) -> Products:
    """One read of a matrix; equal rows may differ in their last bits, by where they stand."""
    narrow = query.astype(np.float32)

    def products(matrix: Array, rows: Array) -> Array:
        whole = len(rows) * 4 > len(matrix)  # else only the rows are read
        return ((matrix @ narrow)[rows] if whole else matrix[rows] @ narrow).astype(np.float64)

    return products


def exact(query: Array) -> Products:
    """In float64, each row for itself: equal rows are equal to the bit, so that ties go to the lowest id."""

    def products(matrix: Array, rows: Array) -> Array:
        blocks = [rows[i : i + BLOCK] for i in range(0, len(rows), BLOCK)]
        return np.concatenate([(matrix[block] * query).sum(axis=1) for block in blocks] or [np.zeros(0)])

    return products


def _outside(objects: Array, exclude: frozenset[int]) -> Array:
    return ~np.isin(objects, list(exclude))


def _known(scores: Array) -> list[float | None]:
    return [None if score != score else score for score in scores.tolist()]
