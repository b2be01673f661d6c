"""The map as matrices: phrases, beliefs, features and boxes of every node, fragments pooled. Made once, read often."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from openbelief.arrays import Array, normalize
from openbelief.grounded.colours import colours_of, without_colour
from openbelief.grounded.fragments import find_fragments
from openbelief.grounded.lexicon import is_known
from openbelief.grounded.looks import count_looks
from openbelief.grounded.options import GroundedOptions
from openbelief.node_table import NodeTable

Encode = Callable[[Sequence[str]], Array]  # (n, d) float64 unit rows
Points = Callable[[int], Array]
CHUNK = 8192


@dataclass(frozen=True, eq=False)
class MapTable:
    """Row i is object i. An entry is one phrase of one node: `row`, `phrase`, `support` (V) and `belief` (p) of it.

    words: the distinct phrases; known: those that the lexicon knows, without their colour. vectors, bare_vectors:
    (U, d) float32 unit rows of the phrases as they are, and without colour. colours: of each phrase. length,
    bare_length: (n,) |sum p g|, that the consensus is divided by; 0 without language. features: (n, d) float32 f^v.
    looks: (n,). low, high, centroid: (n, 3) of the node itself. background, spoken: (n,) bool. group: (n,) one number
    for the pieces of one thing.
    """

    words: tuple[str, ...]
    colours: tuple[frozenset[str], ...]
    known: Mapping[int, str]
    vectors: Array = field(repr=False)
    bare_vectors: Array = field(repr=False)
    row: Array = field(repr=False)
    phrase: Array = field(repr=False)
    support: Array = field(repr=False)
    belief: Array = field(repr=False)
    length: Array = field(repr=False)
    bare_length: Array = field(repr=False)
    features: Array = field(repr=False)
    looks: Array = field(repr=False)
    low: Array = field(repr=False)
    high: Array = field(repr=False)
    centroid: Array = field(repr=False)
    background: Array = field(repr=False)
    group: Array = field(repr=False)
    feature_text_aligned: bool = True

    def __len__(self) -> int:
        return len(self.looks)

    @property
    def spoken(self) -> Array:
        return self.length > 0

    def of_rows(self, values: Array) -> Array:
        """(n,) sums of (E,) values over the entries of each node."""
        return np.bincount(self.row, weights=values, minlength=len(self))

    def phrases_of(self, i: int) -> list[tuple[str, float]]:
        """The phrases of a node with their belief, strongest first."""
        mine = np.flatnonzero(self.row == i)
        return sorted(((self.words[self.phrase[e]], float(self.belief[e])) for e in mine), key=lambda item: -item[1])


def map_table(nodes: NodeTable, points: Points, encode: Encode, options: GroundedOptions) -> MapTable:
    """Everything that no query changes. points: of node i, (m, 3), asked for only where two may be one thing.

    encode: embeds the phrases that lose a colour word; all else is in the memory.
    """
    low, high = nodes.aabb[:, 0].astype(np.float64), nodes.aabb[:, 1].astype(np.float64)
    fragments = find_fragments(low, high, nodes.feature, points, options)
    entries = _pooled(nodes, fragments.overlap)
    looks = count_looks(nodes, options)
    seen = _mass(nodes)[:, None] * nodes.feature.astype(np.float64)
    pooled = normalize(seen + fragments.overlap @ seen).astype(np.float32)
    bare_vectors = _bare_vectors(nodes, encode)
    aligned = nodes.evidence.feature_text_aligned
    belief = _belief(entries, nodes.phrase_embedding, pooled if aligned else None, options, len(nodes))
    return MapTable(
        words=nodes.phrases,
        colours=tuple(map(colours_of, nodes.phrases)),
        known={u: bare for u, word in enumerate(nodes.phrases) if is_known(bare := without_colour(word))},
        vectors=nodes.phrase_embedding,
        bare_vectors=bare_vectors,
        row=entries[0],
        phrase=entries[1],
        support=entries[2],
        belief=belief,
        length=_lengths(entries, belief, nodes.phrase_embedding, len(nodes)),
        bare_length=_lengths(entries, belief, bare_vectors, len(nodes)),
        features=pooled,
        looks=looks + fragments.overlap @ looks,
        low=low,
        high=high,
        centroid=nodes.centroid,
        background=nodes.background,
        group=fragments.group,
        feature_text_aligned=aligned,
    )


def _mass(nodes: NodeTable) -> Array:
    """(n,) the summed w_e of what was said of each node; 1 where nothing was."""
    mass = np.bincount(_rows(nodes), weights=nodes.saying_weight, minlength=len(nodes))
    return np.where(nodes.spoken, mass, 1.0)


def _rows(nodes: NodeTable) -> Array:
    """(Q,) the node of every saying."""
    return np.repeat(np.arange(len(nodes)), np.diff(nodes.object_saying_start))


def _pooled(nodes: NodeTable, overlap: Any) -> tuple[Array, Array, Array]:
    """(E,) row, phrase and V_i + sum_j o_ij V_j of every entry, by row."""
    from scipy.sparse import coo_matrix

    shape = (len(nodes), max(len(nodes.phrases), 1))
    V = coo_matrix((nodes.saying_weight, (_rows(nodes), nodes.saying)), shape=shape).tocsr()
    pooled = (V + overlap @ V).tocoo()
    order = np.lexsort((pooled.col, pooled.row))
    return pooled.row[order].astype(np.int64), pooled.col[order].astype(np.int64), pooled.data[order]


def _bare_vectors(nodes: NodeTable, encode: Encode) -> Array:
    """(U, d) float32 of the phrases without their colour."""
    number = {phrase: u for u, phrase in enumerate(nodes.phrases)}
    bare = [without_colour(phrase) for phrase in nodes.phrases]
    missing = sorted(set(bare) - number.keys())
    more = np.asarray(encode(missing), dtype=np.float32) if missing else nodes.phrase_embedding[:0]
    place = number | {phrase: len(number) + k for k, phrase in enumerate(missing)}
    return np.concatenate([nodes.phrase_embedding, more])[[place[phrase] for phrase in bare]]


def _belief(
    entries: tuple[Array, Array, Array], vectors: Array, features: Array | None, options: GroundedOptions, n: int
) -> Array:
    """(E,) p_p ~ (V_p + prior)^power exp(gain <g_p, f^v>), summing to 1 over each node."""
    row, phrase, support = entries
    logs = options.support_power * np.log(support + options.support_prior)
    if features is not None:
        for start in range(0, len(row), CHUNK):
            part = slice(start, start + CHUNK)
            logs[part] += options.visual_gain * np.einsum("ed,ed->e", vectors[phrase[part]], features[row[part]])
    most = np.full(n, -np.inf)
    np.maximum.at(most, row, logs)
    raw = np.exp(logs - most[row])
    return raw / np.bincount(row, weights=raw, minlength=n)[row]


def _lengths(entries: tuple[Array, Array, Array], belief: Array, vectors: Array, n: int) -> Array:
    """(n,) |sum_p p g_p| of each node."""
    from scipy.sparse import csr_matrix

    row, phrase, _ = entries
    beliefs = csr_matrix((belief, (row, phrase)), shape=(n, len(vectors)))
    chunks = [beliefs[start : start + CHUNK] @ vectors for start in range(0, n, CHUNK)]
    return np.concatenate([np.linalg.norm(chunk, axis=1) for chunk in chunks] or [np.zeros(0)])
