"""ObjectNode: one object and all the evidence for it (paper: eq. node-state)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from openbelief.arrays import Array, read_only
from openbelief.belief import Concept, Trust
from openbelief.node_table import NodeTable
from openbelief.observation import Observation
from openbelief.stored_observations import Members


@dataclass(frozen=True, eq=False)
class ObjectNode:
    """B_i = (P_i, f_i^v, O_i, V_i, p_i, f_i^t, rho_i): one object and all the evidence for it, a row of the table.

    Of a memory that was opened from a file, points and observations are read when they are asked for; that may raise
    BeliefFileError.
    """

    table: NodeTable = field(repr=False)
    id: int

    @cached_property
    def points(self) -> Array:
        """P_i, (n, 3) float32, map frame, metres: the observations' points, repeats once."""
        return self.table.points_of(self.id)

    @cached_property
    def observations(self) -> Sequence[Observation]:
        """O_i and those without language, in canonical order; each read when it is asked for."""
        order, start = self.table.members
        return Members(self.table.evidence.observations, order[start[self.id] : start[self.id + 1]].tolist())

    @property
    def feature(self) -> Array:
        """f_i^v, (d,) float32."""
        return self.table.feature[self.id]

    @property
    def consensus(self) -> Array | None:
        """f_i^t, (d,) float32, None without language."""
        return self.table.consensus[self.id] if self.table.spoken[self.id] else None

    @cached_property
    def concepts(self) -> tuple[Concept, ...]:
        """V_i, p_i and g_i by falling support, () without language."""
        table = self.table
        concepts = []
        for k in range(table.concept_start[self.id], table.concept_start[self.id + 1]):
            said = table.saying[table.saying_start[k] : table.saying_start[k + 1]]
            phrases = tuple(table.phrases[row] for row in said)
            numbers = float(table.support[k]), float(table.belief[k])
            concepts.append(Concept(phrases[0], phrases, *numbers, table.concept_embedding[k]))
        return tuple(concepts)

    @property
    def trust(self) -> Trust:
        """rho_i."""
        return "trusted" if self.table.trusted[self.id] else "degraded"

    @property
    def aabb(self) -> Array:
        """(2, 3) float32, min and max of its points."""
        return self.table.aabb[self.id]

    @property
    def centroid(self) -> Array:
        """(3,) float64, mean of the unique voxels' centres."""
        return self.table.centroid[self.id]

    @property
    def heaviest_phrase(self) -> str | None:
        """The phrase with most support, whichever concept it belongs to; None without language."""
        row = int(self.table.heaviest[self.id])
        return None if row < 0 else self.table.phrases[row]

    @property
    def room(self) -> str | None:
        """The one around the centroid, None where none is known."""
        return self.table.rooms[self.id]

    @property
    def label(self) -> str | None:
        """The heaviest phrase of the heaviest concept, None without language."""
        return self.concepts[0].label if self.concepts else None

    @property
    def background(self) -> bool:
        """True for what a robot is not sent to, by its heaviest phrase: a wall, the floor."""
        return bool(self.table.background[self.id])

    @property
    def frames(self) -> int:
        """In how many distinct frames it was seen."""
        return int(self.table.frames[self.id])

    @cached_property
    def keys(self) -> tuple[tuple[str, int, int], ...]:
        """(recording, frame, mask) of its observations; reads none of them."""
        order, start = self.table.members
        keys = self.table.evidence.keys
        return tuple(keys[i] for i in order[start[self.id] : start[self.id + 1]])

    @cached_property
    def embeddings(self) -> Array:
        """(K, d) float64 g_ik."""
        begin, end = self.table.concept_start[self.id : self.id + 2]
        return read_only(self.table.concept_embedding[begin:end].astype(np.float64))

    @cached_property
    def belief(self) -> Array:
        """(K,) float64 p_ik."""
        begin, end = self.table.concept_start[self.id : self.id + 2]
        return read_only(self.table.belief[begin:end].copy())
