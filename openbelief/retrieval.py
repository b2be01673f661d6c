"""Free-form retrieval (Sec. III-E): three language heads, reliability fusion, and the retrieval rule with exclusion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np

from openbelief.arrays import Array
from openbelief.node import ObjectNode
from openbelief.parameters import Parameters

Readout = Literal["consensus", "early", "belief"]
Scores: TypeAlias = list[float | None]
NOTHING_TO_COMPARE = -1.0  # the lowest cosine: a node without language whose feature is not text-aligned comes last


@dataclass(frozen=True)
class Candidate:
    """An object and how well it fits a query: the fused score, and its channels (None where there is none).

    language: H_i; where features are not text-aligned, H_i as far as its node is trusted (`as_far_as_trusted`).
    """

    object_id: int
    score: float
    visual: float | None
    language: float | None


def consensus_head(consensus: Array, query: Array) -> float:
    """H_i^con = <f_i^t, f_q>."""
    return float(consensus @ query)


def early_head(embeddings: Array, query: Array) -> float:
    """H_i^early = <g_ik*, f_q>, k* = argmax_k V_ik: concepts come by falling support."""
    return float(embeddings[0] @ query)


def belief_head(belief: Array, embeddings: Array, query: Array) -> float:
    """H_i^bel = sum_k p_ik <g_ik, f_q> (eq. retrieval-heads)."""
    return float(belief @ (embeddings @ query))


def language_score(node: ObjectNode, query: Array, readout: Readout) -> float | None:
    """H_i^(r)(q) of (d,) unit query; None where K_i = 0."""
    if not node.concepts or node.consensus is None:
        return None
    embeddings = node.embeddings
    return {
        "consensus": lambda: consensus_head(node.consensus.astype(np.float64), query),
        "early": lambda: early_head(embeddings, query),
        "belief": lambda: belief_head(node.belief, embeddings, query),
    }[readout]()


def visual_weight(node: ObjectNode, parameters: Parameters) -> float:
    """lambda_i (eq. reliability-fusion)."""
    if not node.concepts:
        return parameters.lambda_no_language
    return {"degraded": parameters.lambda_degraded, "trusted": parameters.lambda_trusted}[node.trust]


def fuse(visual: float, language: float | None, visual_weight: float) -> float:
    """S_i = lambda_i <f_i^v, f_q> + (1 - lambda_i) H_i (eq. retrieval-score); without language the visual score."""
    return visual if language is None else visual_weight * visual + (1.0 - visual_weight) * language


def as_far_as_trusted(nodes: Sequence[ObjectNode], language: Scores, parameters: Parameters) -> Scores:
    """H_i where there is no visual branch for doubt to lean on: then lambda = 0, and the score is the language alone.

    Degraded nodes still place less weight on language, as in eq. reliability-fusion: theirs is (1 - lambda_i) relative
    to the most trusted nodes of the map. With plain H_i one stray detection called "cup" beats 48 looks at a cup.
    """
    spoken = [1.0 - visual_weight(n, parameters) for n, h in zip(nodes, language, strict=True) if h is not None]
    best = max(spoken, default=0.0) or 1.0
    return [
        None if h is None else (1.0 - visual_weight(n, parameters)) / best * h
        for n, h in zip(nodes, language, strict=True)
    ]


def score(
    nodes: Sequence[ObjectNode], query: Array, readout: Readout, parameters: Parameters, feature_text_aligned: bool
) -> list[Candidate]:
    """Every node's candidate for a (d,) float64 unit query, in the order of the nodes."""
    visual: Scores = [float(n.feature.astype(np.float64) @ query) if feature_text_aligned else None for n in nodes]
    language: Scores = [language_score(n, query, readout) for n in nodes]
    if not feature_text_aligned:
        language = as_far_as_trusted(nodes, language, parameters)
    seen, said = (visual, language) if parameters.fusion == "paper" else (_standard(visual), _standard(language))
    if feature_text_aligned:
        rows = zip(nodes, seen, said, strict=True)
        fused = [fuse(v, h, visual_weight(n, parameters)) for n, v, h in rows if v is not None]
    else:
        fused = [NOTHING_TO_COMPARE if h is None else h for h in said]
    return [Candidate(n.id, s, v, h) for n, s, v, h in zip(nodes, fused, visual, language, strict=True)]


def best_first(candidates: Sequence[Candidate], exclude: frozenset[int]) -> list[Candidate]:
    """A_q = V_o minus R_q by falling score, ties by lowest id (eq. retrieval-rule)."""
    return sorted((c for c in candidates if c.object_id not in exclude), key=lambda c: (-c.score, c.object_id))


def check_readout(readout: str) -> Readout:
    for known in get_args(Readout):
        if readout == known:
            return known
    raise ValueError(f"Readout should be one of {', '.join(get_args(Readout))}, got {readout!r}.")


def _standard(scores: Scores) -> Scores:
    """One channel as z-scores over the map: image-text and text-text cosines are on different scales."""
    known = np.array([s for s in scores if s is not None])
    spread = known.std() if len(known) else 0.0
    return [None if s is None else float((s - known.mean()) / spread) if spread > 0 else 0.0 for s in scores]
