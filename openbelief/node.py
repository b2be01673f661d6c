"""ObjectNode: one object and all the evidence for it (paper: eq. node-state)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from openbelief.arrays import Array, read_only
from openbelief.belief import Concept, Trust, concepts, consensus, phrase_support, trust, visual_feature
from openbelief.observation import Observation
from openbelief.parameters import Parameters
from openbelief.phrase import is_background
from openbelief.rooms import Room, room_at


@dataclass(frozen=True, eq=False)
class ObjectNode:
    """B_i = (P_i, f_i^v, O_i, V_i, p_i, f_i^t, rho_i): one object and all the evidence for it.

    points: P_i, (n, 3) float32, map frame, metres: the observations' points, repeats once. feature: f_i^v, (d,)
    float32. observations: in canonical order. concepts: V_i, p_i and g_i by falling support, () without language.
    consensus: f_i^t, (d,) float32, None without language. trust: rho_i. aabb: (2, 3) float32, min and max.
    centroid: (3,) float64, mean of the unique voxels' centres. heaviest_phrase: the one with most support, whichever
    concept it belongs to; None without language. room: the one around the centroid, None where none is known.
    """

    id: int
    points: Array = field(repr=False)
    feature: Array = field(repr=False)
    observations: tuple[Observation, ...] = field(repr=False)
    concepts: tuple[Concept, ...] = field(repr=False)
    consensus: Array | None = field(repr=False)
    trust: Trust
    aabb: Array
    centroid: Array
    heaviest_phrase: str | None = None
    room: str | None = None

    @property
    def label(self) -> str | None:
        """The heaviest phrase of the heaviest concept, None without language."""
        return self.concepts[0].label if self.concepts else None

    @property
    def background(self) -> bool:
        """True for what a robot is not sent to, by its heaviest phrase: a wall, the floor."""
        return self.heaviest_phrase is not None and is_background(self.heaviest_phrase)

    @property
    def frames(self) -> int:
        """In how many distinct frames it was seen."""
        return len({(o.recording, o.frame) for o in self.observations})

    @cached_property
    def embeddings(self) -> Array:
        """(K, d) float64 g_ik."""
        return read_only(np.array([c.embedding for c in self.concepts], dtype=np.float64))

    @cached_property
    def belief(self) -> Array:
        """(K,) float64 p_ik."""
        return read_only(np.array([c.belief for c in self.concepts], dtype=np.float64))


def make_node(
    object_id: int,
    members: list[Observation],
    embeddings: Mapping[str, Array],
    threshold: float,
    parameters: Parameters,
    rooms: Sequence[Room] = (),
) -> ObjectNode:
    """B_i of its observations, in canonical order; `embeddings` holds every comparable phrase."""
    points = unique_rows(np.concatenate([o.points for o in members]))
    hypotheses = concepts(members, embeddings, threshold, parameters)
    belief = np.array([c.belief for c in hypotheses])
    rows = np.array([c.embedding for c in hypotheses], dtype=np.float64)
    support, centroid = phrase_support(members, parameters), _centroid(points, parameters.voxel_m)
    return ObjectNode(
        id=object_id,
        points=read_only(points),
        feature=visual_feature(members, parameters),
        observations=tuple(members),
        concepts=hypotheses,
        consensus=read_only(consensus(belief, rows).astype(np.float32)) if hypotheses else None,
        trust=trust(members, parameters),
        aabb=read_only(np.array([points.min(axis=0), points.max(axis=0)])),
        centroid=read_only(centroid),
        heaviest_phrase=max(support, key=support.__getitem__, default=None),
        room=room_at(centroid, rooms),
    )


def unique_rows(rows: Array) -> Array:
    """The distinct rows of (n, 3), in lexicographic order; five times as fast as np.unique over an axis."""
    ordered = rows[np.lexsort(rows.T[::-1])]
    return ordered[np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))]


def _centroid(points: Array, voxel_m: float) -> Array:
    """(3,) float64: the mean of the occupied voxels' centres, each once, so dense views do not pull it."""
    return ((unique_rows(np.floor(points.astype(np.float64) / voxel_m)) + 0.5) * voxel_m).mean(axis=0)
