"""The nodes of a memory in columns: row i is object i, matrices ready to be multiplied (paper: eq. node-state)."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import cached_property

import numpy as np

from openbelief.arrays import Array, read_only
from openbelief.backprojection import distinct_points
from openbelief.columns import Column, SealedColumns
from openbelief.evidence import Evidence
from openbelief.phrase import is_background
from openbelief.pieces import COSINE, PIECE_COLUMNS, RADIUS_M, Pieces, find_pieces
from openbelief.rooms import rooms_at

# N objects; K concepts and Q sayings, grouped by object; P phrases of d numbers; features of D.
COLUMNS = {
    "feature": Column("<f4", ("N", "D")),  # f_i^v
    "consensus": Column("<f4", ("N", "d")),  # f_i^t; zeros without language
    "trusted": Column("|u1", ("N",)),  # rho_i
    "aabb": Column("<f4", ("N", 2, 3)),
    "centroid": Column("<f8", ("N", 3)),
    "frames": Column("<i4", ("N",)),  # in how many distinct frames it was seen
    "heaviest": Column("<i4", ("N",), below="P", least=-1),  # the phrase with most support, -1 without language
    "concept_start": Column("<i8", ("N+1",), starts="K"),
    "support": Column("<f8", ("K",)),  # V_ik, falling within an object
    "belief": Column("<f8", ("K",)),  # p_ik
    "concept_embedding": Column("<f4", ("K", "d")),  # g_ik
    "saying_start": Column("<i8", ("K+1",), starts="Q"),
    "saying": Column("<i4", ("Q",), below="P"),  # a concept's phrases, by falling support
    "saying_weight": Column("<f8", ("Q",)),  # the summed w_e of that phrase for that object
    "phrase_embedding": Column("<f4", ("P", "d")),  # the evidence's `embeddings`, in alphabetical order
}


class NodeTable:
    """All nodes. Every array is read-only; of a memory that was opened, one is read when it is first asked for.

    feature: f_i^v, (N, D) float32. consensus: f_i^t, (N, d) float32, zeros without language. trusted: rho_i, (N,) bool.
    Concepts of object i: rows concept_start[i] to concept_start[i + 1] of `support`, `belief` and `concept_embedding`,
    by falling support. What was said of concept k: rows saying_start[k] to saying_start[k + 1] of `saying` (rows of
    `phrases` and of `phrase_embedding`) and `saying_weight`. aabb: (N, 2, 3) and centroid: (N, 3), map frame, metres.
    """

    def __init__(self, evidence: Evidence, columns: Mapping[str, Array]) -> None:
        self.evidence, self.columns = evidence, columns

    def __len__(self) -> int:
        return len(self.concept_start) - 1

    @property
    def feature(self) -> Array:
        return self.columns["feature"]

    @property
    def consensus(self) -> Array:
        return self.columns["consensus"]

    @property
    def concept_start(self) -> Array:
        return self.columns["concept_start"]

    @property
    def support(self) -> Array:
        return self.columns["support"]

    @property
    def belief(self) -> Array:
        return self.columns["belief"]

    @property
    def concept_embedding(self) -> Array:
        return self.columns["concept_embedding"]

    @property
    def saying_start(self) -> Array:
        return self.columns["saying_start"]

    @property
    def saying(self) -> Array:
        return self.columns["saying"]

    @property
    def saying_weight(self) -> Array:
        return self.columns["saying_weight"]

    @property
    def aabb(self) -> Array:
        return self.columns["aabb"]

    @property
    def centroid(self) -> Array:
        return self.columns["centroid"]

    @property
    def frames(self) -> Array:
        return self.columns["frames"]

    @property
    def heaviest(self) -> Array:
        return self.columns["heaviest"]

    @property
    def phrases(self) -> tuple[str, ...]:
        """Every comparable phrase, in alphabetical order."""
        return self.evidence.embeddings.phrases

    @property
    def phrase_embedding(self) -> Array:
        """(P, d) float32 unit rows."""
        return self.columns["phrase_embedding"]

    @cached_property
    def trusted(self) -> Array:
        return self.columns["trusted"].astype(bool)

    @cached_property
    def spoken(self) -> Array:
        """(N,) bool: K_i > 0."""
        return np.diff(self.concept_start) > 0

    @cached_property
    def object_saying_start(self) -> Array:
        """(N + 1,): all that was said of object i, whatever the concept, is saying[start[i]:start[i + 1]]."""
        return self.saying_start[self.concept_start]

    @cached_property
    def background(self) -> Array:
        """(N,) bool: what a robot is not sent to, by its heaviest phrase."""
        known = np.array([*(is_background(phrase) for phrase in self.phrases), False])
        return known[self.heaviest]  # -1, without language, is the last

    @cached_property
    def members(self) -> tuple[Array, Array]:
        """Observations grouped by object, in canonical order, and (N + 1,) where each object's begin."""
        partition = self.evidence.partition
        return np.argsort(partition, kind="stable"), np.searchsorted(np.sort(partition), np.arange(len(self) + 1))

    @cached_property
    def rooms(self) -> tuple[str | None, ...]:
        """The room around each centroid, None where none is known."""
        return rooms_at(self.centroid, self.evidence.rooms)

    def points_of(self, i: int) -> Array:
        """P_i, (n, 3) float32, map frame, metres: the points of its observations, repeats once; reads them."""
        order, start = self.members
        seen = [self.evidence.observations[k] for k in order[start[i] : start[i + 1]].tolist()]
        points = np.concatenate([observation.points for observation in seen])
        return read_only(distinct_points(points, self.evidence.parameters.voxel_m))

    @cached_property
    def pieces(self) -> Pieces:
        """As the file has them, else found now."""
        if all(name in self.columns for name in PIECE_COLUMNS):
            return Pieces(*(self.columns[name] for name in PIECE_COLUMNS))
        return self.find_pieces(RADIUS_M, COSINE)

    def find_pieces(self, radius_m: float, cosine: float) -> Pieces:
        """Reads the points of those that may be pieces."""
        return find_pieces(self.aabb, self.feature, self.points_of, radius_m, cosine, self.evidence.parameters.voxel_m)

    def concepts_of(self, objects: Array) -> tuple[Array, Array]:
        """Rows of all concepts of (n,) spoken objects, one object after the other, and (n,) where each one's begin."""
        first, count = self.concept_start[objects], np.diff(self.concept_start)[objects]
        begin = np.cumsum(count) - count
        return np.repeat(first - begin, count) + np.arange(count.sum()), begin

    def digest(self) -> bytes:
        """32 bytes over every column as it is now; one that nobody asked for counts as its file names it."""
        unread = self.columns.unread() if isinstance(self.columns, SealedColumns) else {}
        sha = hashlib.sha256()
        for name in self.columns:
            sha.update(unread.get(name) or hashlib.sha256(_bytes(self.columns[name])).digest())
        return sha.digest()


def _bytes(array: Array) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data
