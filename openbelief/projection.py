"""Fixed-vocabulary readouts (Sec. III-E): visual, consensus, early-commit and full-belief class distributions."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from openbelief.arrays import Array
from openbelief.node import ObjectNode
from openbelief.parameters import Parameters

Projection = Literal["visual", "consensus", "early", "full"]


def softmax(scores: Array) -> Array:
    """Along the last axis; float64."""
    exponentials = np.exp(scores - scores.max(axis=-1, keepdims=True))
    return exponentials / exponentials.sum(axis=-1, keepdims=True)


def refine(belief: Array, embeddings: Array, feature: Array, parameters: Parameters) -> Array:
    """Tempered p~_ik (eq. belief-refinement): visual re-ranking that keeps the support (p = 0 stays 0)."""
    evidence = embeddings @ feature / parameters.t_vis
    tempered = belief**parameters.gamma * np.exp(evidence - evidence.max())
    return tempered / tempered.sum()


def visual_distribution(feature: Array, classes: Array, parameters: Parameters) -> Array:
    """v_i(c) = softmax_c(<f_i^v, t_c> / T_obj)."""
    return softmax(classes @ feature / parameters.t_obj)


def affinity(embeddings: Array, classes: Array, parameters: Parameters) -> Array:
    """W_ikc = softmax_c(<g_ik, t_c> / T_proj); (K, C)."""
    return softmax(embeddings @ classes.T / parameters.t_proj)


def mixed(belief: Array, node: ObjectNode, classes: Array, parameters: Parameters) -> Array:
    """(1 - lambda_vis) sum_k p~_ik W_ikc + lambda_vis v_i(c) (eq. fixed-vocab-readout, K_i > 0)."""
    feature = node.feature.astype(np.float64)
    language = refine(belief, node.embeddings, feature, parameters) @ affinity(node.embeddings, classes, parameters)
    visual = visual_distribution(feature, classes, parameters)
    return (1.0 - parameters.lambda_vis) * language + parameters.lambda_vis * visual


def one_hot(node: ObjectNode) -> Array:
    """All belief at k* = argmax_k V_ik: concepts come by falling support."""
    return np.eye(len(node.concepts))[0]


def project_node(node: ObjectNode, classes: Array, readout: Projection, parameters: Parameters) -> Array:
    """(C,) class distribution of one node for (C, d) unit class embeddings; v_i(c) where K_i = 0."""
    if readout == "visual" or not node.concepts or node.consensus is None:
        return visual_distribution(node.feature.astype(np.float64), classes, parameters)
    if readout == "consensus":
        return consensus_distribution(node.consensus, classes, parameters)
    return mixed(one_hot(node) if readout == "early" else node.belief, node, classes, parameters)


def consensus_distribution(consensus: Array, classes: Array, parameters: Parameters) -> Array:
    """softmax_c(<f_i^t, t_c> / T_proj) (eq. consensus-projection, K_i > 0)."""
    return softmax(classes @ consensus.astype(np.float64) / parameters.t_proj)


def project_language(node: ObjectNode, classes: Array, readout: Projection, parameters: Parameters) -> Array:
    """(C,) distribution where features are not text-aligned: language alone; uniform where there is none.

    Raises ValueError on the readouts that need the visual channel.
    """
    if readout in ("visual", "full"):
        raise ValueError(
            f"The {readout!r} projection compares features with text, and this memory's features are not text-aligned: "
            "use 'consensus' or 'early'."
        )
    if not node.concepts or node.consensus is None:
        return np.full(len(classes), 1.0 / len(classes))
    if readout == "consensus":
        return consensus_distribution(node.consensus, classes, parameters)
    return affinity(node.embeddings[:1], classes, parameters)[0]


def check_projection(readout: str) -> Projection:
    for known in get_args(Projection):
        if readout == known:
            return known
    raise ValueError(f"Projection should be one of {', '.join(get_args(Projection))}, got {readout!r}.")
