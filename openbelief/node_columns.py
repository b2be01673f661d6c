"""Belief, derived: from the evidence of every object to the columns of a NodeTable (Sec. III-D)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from openbelief.arrays import Array, bounds, read_only
from openbelief.backprojection import occupied_voxels
from openbelief.belief import (
    Concept,
    concepts,
    consensus,
    phrase_support,
    synonym_threshold,
    trust,
    visual_feature,
)
from openbelief.evidence import Evidence
from openbelief.node_table import COLUMNS
from openbelief.observation import Observation

BELIEF = 1  # raised when other columns are made of the same evidence; those of a file with another are derived anew


def believe(evidence: Evidence) -> dict[str, Array]:
    """The columns of COLUMNS: the same evidence, partition and parameters give the same."""
    columns = _Columns(evidence)
    for members in _by_object(evidence):
        columns.add(members)
    return columns.finished()


class _Columns:
    """Grows by one object at a time."""

    def __init__(self, evidence: Evidence) -> None:
        self._embeddings, self._parameters = evidence.embeddings, evidence.parameters
        self._threshold = synonym_threshold(evidence.parameters, evidence.text_encoder_id)
        self._row = {phrase: row for row, phrase in enumerate(evidence.embeddings.phrases)}
        self._dims = {"d": evidence.text_dim, "D": evidence.text_dim}
        self._phrase_embedding = evidence.embeddings.rows
        self._lists: dict[str, list[object]] = {name: [] for name in COLUMNS}
        self._lists["concept_start"], self._lists["saying_start"] = [0], [0]

    def add(self, members: list[Observation]) -> None:
        """B_i of its observations, in canonical order."""
        support = phrase_support(members, self._parameters)
        hypotheses = concepts(members, self._embeddings, self._threshold, self._parameters)
        points = np.concatenate([o.points for o in members])
        heaviest = max(support, key=support.__getitem__, default=None)
        self._dims["D"] = len(members[0].feature)
        row = {
            "feature": visual_feature(members, self._parameters),
            "consensus": _consensus(hypotheses, self._dims["d"]),
            "trusted": trust(members, self._parameters) == "trusted",
            "aabb": bounds(points),
            "centroid": voxel_centroid(points, self._parameters.voxel_m),
            "frames": len({(o.recording, o.frame) for o in members}),
            "heaviest": -1 if heaviest is None else self._row[heaviest],
        }
        for name, value in row.items():
            self._lists[name].append(value)
        for concept in hypotheses:
            self._say(concept, support)
        self._lists["concept_start"].append(len(self._lists["support"]))

    def _say(self, concept: Concept, support: Mapping[str, float]) -> None:
        self._lists["support"].append(concept.support)
        self._lists["belief"].append(concept.belief)
        self._lists["concept_embedding"].append(concept.embedding)
        self._lists["saying"] += [self._row[phrase] for phrase in concept.phrases]
        self._lists["saying_weight"] += [support[phrase] for phrase in concept.phrases]
        self._lists["saying_start"].append(len(self._lists["saying"]))

    def finished(self) -> dict[str, Array]:
        columns = {"phrase_embedding": self._phrase_embedding}
        for name, column in COLUMNS.items():
            rest = [self._dims[n] if isinstance(n, str) else n for n in column.shape[1:]]
            values = np.array(self._lists.pop(name), dtype=column.dtype)
            columns.setdefault(name, read_only(values.reshape(-1, *rest)))
        return columns


def _by_object(evidence: Evidence) -> Iterator[list[Observation]]:
    order = np.argsort(evidence.partition, kind="stable").tolist()
    ends = np.cumsum(np.bincount(evidence.partition)).tolist() if order else []
    for begin, end in zip([0, *ends], ends, strict=False):
        yield [evidence.observations[i] for i in order[begin:end]]


def _consensus(hypotheses: Sequence[Concept], dim: int) -> Array:
    if not hypotheses:
        return np.zeros(dim, np.float32)
    belief = np.array([c.belief for c in hypotheses])
    rows = np.array([c.embedding for c in hypotheses], dtype=np.float64)
    return consensus(belief, rows).astype(np.float32)


def voxel_centroid(points: Array, voxel_m: float) -> Array:
    """(3,) float64: the mean of the occupied voxels' centres, each once, so dense views do not pull it."""
    voxels = occupied_voxels(points, voxel_m)
    steps = np.ascontiguousarray((voxels.steps + voxels.low[:, None]).T)
    return ((steps + 0.5) * voxel_m).mean(axis=0)
