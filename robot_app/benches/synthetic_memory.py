"""Memories of any size, made from a seed: a site whose association is known, and a table of nodes alone."""

from __future__ import annotations

from itertools import product

import numpy as np

from openbelief.arrays import Array, read_only
from openbelief.embedding import PhraseEmbeddings
from openbelief.evidence import Evidence
from openbelief.node_table import NodeTable
from openbelief.observation import Observation, Provenance
from openbelief.parameters import Parameters
from openbelief.pieces import Pieces

DIM = 512


def evidence(objects: int, views: int = 4, points: int = 150, seed: int = 0) -> Evidence:
    """A site whose association is known: every object has so many views, by 1 to 3 of 600 phrases, in 512 numbers."""
    rng = np.random.default_rng(seed)
    words = _words()
    seen, partition = [], []
    for number in range(objects):
        look, names = _unit(rng.normal(size=DIM)), rng.integers(0, len(words), 3)
        for view in range(views):
            feature = _unit(look + rng.normal(size=DIM) * 0.02).astype(np.float32)
            at = np.array([number % 100, number // 100, 0])
            cloud = (rng.uniform(0, 0.5, (points, 3)) + at).astype(np.float32)
            phrase, frame = words[names[min(view, int(rng.integers(0, 3)))]], number * views + view
            source = Provenance("bench", frame, (0, 0, 9, 9), {"size": [9, 9], "counts": [9, 9, 63]}, b"\xff\xd8" * 400)
            seen.append(Observation(frame, 0, phrase, 0.9, cloud, feature, source))
            partition.append(number)
    rows = read_only(_unit(rng.normal(size=(len(words), DIM))).astype(np.float32))
    return Evidence(
        observations=seen,
        digests=np.frombuffer(b"".join(o.digest for o in seen), np.uint8).reshape(-1, 32),
        partition=np.array(partition, np.int64),
        embeddings=PhraseEmbeddings(words, rows),
        frames=(),
        rooms=(),
        about={},
        parameters=Parameters(),
        text_encoder_id="bench",
        text_dim=DIM,
        feature_text_aligned=True,
    )


def node_table(objects: int, seed: int = 0) -> NodeTable:
    """The columns alone: 1 or 2 concepts an object, each called by one phrase; no two look alike, none are pieces."""
    rng = np.random.default_rng(seed)
    none = evidence(0)
    concepts = 1 + rng.integers(0, 2, objects)
    start = np.append(0, np.cumsum(concepts))
    total = int(start[-1])

    def unit(rows: int) -> Array:
        made = rng.standard_normal((rows, DIM), dtype=np.float32)
        return made / np.linalg.norm(made, axis=1, keepdims=True)

    centroid = rng.uniform(0, 100, (objects, 3))
    belief = np.where(np.repeat(concepts, concepts) == 1, 1.0, 0.5)
    return NodeTable(
        none,
        {
            "feature": unit(objects),
            "consensus": unit(objects),
            "trusted": rng.integers(0, 2, objects, dtype=np.uint8),
            "aabb": np.stack((centroid - 0.2, centroid + 0.2), axis=1).astype(np.float32),
            "centroid": centroid,
            "frames": np.ones(objects, np.int32),
            "heaviest": rng.integers(0, len(none.embeddings), objects, dtype=np.int32),
            "concept_start": start,
            "support": belief * 10,
            "belief": belief,
            "concept_embedding": unit(total),
            "saying_start": np.arange(total + 1),
            "saying": rng.integers(0, len(none.embeddings), total, dtype=np.int32),
            "saying_weight": belief * 10,
            "phrase_embedding": none.embeddings.rows,
            **Pieces(np.zeros((0, 2)), np.zeros(0)).columns(),
        },
    )


def _words() -> list[str]:
    """600 phrases of two made-up words, in alphabetical order."""
    syllables = ("ba", "do", "fi", "ke", "lu")
    words = ["".join(pair) for pair in product(syllables, repeat=2)]
    return sorted(" ".join(pair) for pair in product(words, repeat=2))[:600]


def _unit(rows: Array) -> Array:
    unit: Array = rows / np.linalg.norm(rows, axis=-1, keepdims=True)
    return unit
