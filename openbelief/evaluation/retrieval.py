"""Retrieval against ground truth: R@1, R@3 and SR@1m by kind of query, and what the nodes are made of.

Right (R@k): the candidate's centroid lies inside an accepted object's box grown by 0.25 m, or the truth's `margin_m`.
Success at 1 m (SR@1m): the first candidate's centroid is within 1 m, horizontally, of an accepted object's box.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from openbelief.evaluation.doubt import doubt_of
from openbelief.evaluation.truth import ABSENT, TrueQuery, Truth
from openbelief.memory import Candidate, ObjectMemory
from openbelief.retrieval import best_first, check_readout, exact, language_scores
from openbelief.target_phrase import target_phrase

SUCCESS_M = 1.0
Ranking = Callable[[str], list[Candidate]]


def evaluate(memory: ObjectMemory, truth: Truth, readout: str = "consensus") -> dict[str, Any]:
    """The result of `eval retrieval` (DESIGN.md). Unfindable and absent queries are reported apart, never scored.

    Where features are not text-aligned, `language_alone` scores the plain language heads (S_i = H_i) beside it. The
    readout "grounded" also says `kept`, `absent_nouns` and `doubt` (openbelief.evaluation.doubt).
    """
    result = _evaluate(memory, truth, lambda query: memory.rank(query, readout), by_head=readout == "grounded")
    if readout == "grounded":
        result |= doubt_of(memory, truth)
    elif not memory.feature_text_aligned:
        alone = _evaluate(memory, truth, lambda query: _language_alone(memory, query, readout))
        result["language_alone"] = {k: alone[k] for k in ("queries", "r_at_1", "r_at_3", "sr_at_1m")}
    return {"readout": readout, **result, "margin_m": truth.margin_m, "nodes": nodes_of(memory, truth)}


def nodes_of(memory: ObjectMemory, truth: Truth) -> dict[str, Any]:
    """Fragmentation and purity: from which true object the masks of a node were drawn (None where unknown)."""
    known: dict[str, Any] = {"nodes": len(memory.objects), "true_objects": len(truth.objects)}
    tables = [_origins(node.observations, truth) for node in memory.objects]
    majorities = [table.most_common(1)[0] for table in tables if table]
    if not majorities:
        return {**known, "mapped_objects": None, "nodes_per_object": None, "purity": None}
    of_objects = Counter(true_id for true_id, _ in majorities if true_id in truth.objects)
    return {
        **known,
        "mapped_objects": len(of_objects),
        "nodes_per_object": of_objects.total() / max(len(of_objects), 1),
        "purity": sum(n for _, n in majorities) / sum(table.total() for table in tables),
    }


def _evaluate(memory: ObjectMemory, truth: Truth, rank: Ranking, by_head: bool = False) -> dict[str, Any]:
    scored = [q for q in truth.queries if q.kind != ABSENT and q.findable]
    unfindable = [q for q in truth.queries if q.kind != ABSENT and not q.findable]
    rankings = {q.query: rank(q.query) for q in scored + unfindable}
    hits = {q: [_right(memory, c, q, truth) for c in rankings[q.query]] for q in scored + unfindable}
    near = {q: _near(memory, rankings[q.query], q, truth) for q in scored + unfindable}
    kinds = sorted({q.kind for q in scored})
    return {
        **_rates(scored, hits, near),
        "by_kind": {kind: _rates([q for q in scored if q.kind == kind], hits, near) for kind in kinds},
        "unfindable": _rates(unfindable, hits, near),
        "absent": _absent(truth, rank, [rankings[q.query] for q in scored], by_head),
        "misses": [_miss(memory, q, rankings[q.query], hits[q]) for q in scored if not any(hits[q][:1])],
    }


def _rates(
    queries: Sequence[TrueQuery], hits: dict[TrueQuery, list[bool]], near: dict[TrueQuery, bool]
) -> dict[str, Any]:
    rate = {
        "r_at_1": [any(hits[q][:1]) for q in queries],
        "r_at_3": [any(hits[q][:3]) for q in queries],
        "sr_at_1m": [near[q] for q in queries],
    }
    return {"queries": len(queries), **{k: float(np.mean(v)) if v else None for k, v in rate.items()}}


def _right(memory: ObjectMemory, candidate: Candidate, query: TrueQuery, truth: Truth) -> bool:
    centroid = memory.objects[candidate.object_id].centroid
    return any(truth.objects[i].contains(centroid, truth.margin_m) for i in query.accept)


def _near(memory: ObjectMemory, ranking: list[Candidate], query: TrueQuery, truth: Truth) -> bool:
    if not ranking:
        return False
    centroid = memory.objects[ranking[0].object_id].centroid
    return any(truth.objects[i].horizontal_distance(centroid) <= SUCCESS_M for i in query.accept)


def _absent(truth: Truth, rank: Ranking, present: list[list[Candidate]], by_head: bool) -> dict[str, Any]:
    """Nothing to find: how far the best scores stay below those of things that are there.

    auc: how often a present thing's best score beats an absent one's; 1 would let a threshold tell them apart. Where
    `by_head`, the score is H: that of the readout "grounded" is on the scale of each question, not of the map.
    """

    def top(ranking: list[Candidate]) -> float:
        return (ranking[0].language or 0.0) if by_head else ranking[0].score

    queries = [q.query for q in truth.queries if q.kind == ABSENT] + list(truth.absent_nouns)
    tops = [top(ranking) for query in queries if (ranking := rank(query))]
    there = np.array([top(ranking) for ranking in present if ranking])
    if not tops or not len(there):
        return {"queries": len(queries), "mean_top_score": None, "max_top_score": None, "auc": None}
    auc = float(np.mean(there[:, None] > np.array(tops)))
    return {
        "queries": len(queries),
        "mean_top_score": float(np.mean(tops)),
        "max_top_score": max(tops),
        "auc": auc,
    }


def _miss(memory: ObjectMemory, query: TrueQuery, ranking: list[Candidate], hits: list[bool]) -> dict[str, Any]:
    first = hits.index(True) if True in hits else None
    because = (
        "no mapped object lies where an accepted one is" if first is None else f"the right one is ranked {first + 1}"
    )
    shown = [ranking[i] for i in sorted({0, 1, 2, *([] if first is None else [first])}) if i < len(ranking)]
    rows = [_row(memory, c, hits[ranking.index(c)]) for c in shown]
    return {
        "query": query.query,
        "kind": query.kind,
        "accept": list(query.accept),
        "because": because,
        "candidates": rows,
    }


def _row(memory: ObjectMemory, candidate: Candidate, right: bool) -> dict[str, Any]:
    node = memory.objects[candidate.object_id]
    return {
        "object_id": node.id,
        "label": node.label,
        "score": candidate.score,
        "centroid": node.centroid.tolist(),
        "right": right,
    }


def _language_alone(memory: ObjectMemory, query: str, readout: str) -> list[Candidate]:
    """The same candidates by their bare H_i, whatever their trust."""
    ranking, head = memory.rank(query, readout), check_readout(readout)
    if not ranking or memory.text_encoder is None:
        return []
    [vector] = memory.text_encoder.encode([target_phrase(query).text])
    objects = np.array([c.object_id for c in ranking])
    bare = language_scores(memory.table, objects, head, exact(vector.astype(np.float64))).tolist()
    return best_first([replace(c, score=h, language=h) for c, h in zip(ranking, bare, strict=True) if h == h])


def _origins(observations: Sequence[Any], truth: Truth) -> Counter[int]:
    keys = [(o.provenance.stamp_ns, o.mask) for o in observations if o.provenance]
    return Counter(truth.mask_origin[key] for key in keys if key in truth.mask_origin)
