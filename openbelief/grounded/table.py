"""The map as matrices: phrases, beliefs, features and boxes of every node, fragments pooled. Made once, read often."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from openbelief.arrays import Array, normalize
from openbelief.grounded.colours import colours_of, without_colour
from openbelief.grounded.entries import beliefs, lengths, pooled_entries, product_of, rows_of_sayings
from openbelief.grounded.fragments import Fragments
from openbelief.grounded.lexicon import is_known
from openbelief.grounded.looks import count_looks
from openbelief.grounded.options import GroundedOptions
from openbelief.node_table import NodeTable
from openbelief.pieces import COSINE, RADIUS_M, Pieces

AT_ONCE = 512  # nodes
Encode = Callable[[Sequence[str]], Array]  # (n, d) float64 unit rows


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

    @cached_property
    def start(self) -> Array:
        """(n + 1,): the entries of node i are start[i] to start[i + 1]."""
        return np.searchsorted(self.row, np.arange(len(self) + 1))

    def believed(self, values: Array) -> Iterator[tuple[slice, Array]]:
        """(m, k) sums of p v over the entries of each of some nodes, of (U, k) values of the phrases; then of more.

        Few nodes at once: what passes through stays in the processor's cache.
        """
        for first in range(0, len(self), AT_ONCE):
            nodes = slice(first, min(first + AT_ONCE, len(self)))
            start, count = self.start[nodes], np.diff(self.start[nodes.start : nodes.stop + 1])
            sums = np.zeros((len(count), values.shape[1]))
            for k in range(int(count.max())):
                there = np.flatnonzero(count > k)
                entry = start[there] + k
                sums[there] += values.take(self.phrase[entry], axis=0) * self.belief[entry, None]
            yield nodes, sums

    @cached_property
    def thing_boxes(self) -> tuple[Array, Array]:
        """Twice (n, 3): the corners of the box around all pieces of the thing that each node is a piece of."""
        nodes = np.argsort(self.group, kind="stable")
        _, first, of_group = np.unique(self.group[nodes], return_index=True, return_inverse=True)
        low, high = np.empty_like(self.low), np.empty_like(self.high)
        low[nodes] = np.minimum.reduceat(self.low[nodes], first)[of_group]
        high[nodes] = np.maximum.reduceat(self.high[nodes], first)[of_group]
        return low, high

    def phrases_of(self, i: int) -> list[tuple[str, float]]:
        """The phrases of a node with their belief, strongest first."""
        mine = np.flatnonzero(self.row == i)
        return sorted(((self.words[self.phrase[e]], float(self.belief[e])) for e in mine), key=lambda item: -item[1])


def map_table(nodes: NodeTable, encode: Encode, options: GroundedOptions) -> MapTable:
    """Everything that no query changes. encode: embeds phrases that lose a colour word; the rest is in the memory."""
    fragments = Fragments.of(_pieces(nodes, options), options.fragment_overlap, len(nodes))
    entries = pooled_entries(nodes, fragments)
    features = _features(nodes, fragments)
    vectors, uncoloured = _vectors(nodes, encode)
    product = product_of(vectors)
    aligned = nodes.evidence.feature_text_aligned
    belief = beliefs(entries, nodes.phrase_embedding, features if aligned else None, options)
    return MapTable(
        words=nodes.phrases,
        colours=tuple(map(colours_of, nodes.phrases)),
        known={u: bare for u, word in enumerate(nodes.phrases) if is_known(bare := without_colour(word))},
        vectors=nodes.phrase_embedding,
        bare_vectors=vectors[uncoloured],
        row=entries.row,
        phrase=entries.phrase,
        support=entries.support,
        belief=belief,
        length=lengths(entries, belief, product, len(nodes)),
        bare_length=lengths(entries._replace(phrase=uncoloured[entries.phrase]), belief, product, len(nodes)),
        features=features,
        looks=fragments.pooled(count_looks(nodes, options)),
        low=nodes.aabb[:, 0].astype(np.float64),
        high=nodes.aabb[:, 1].astype(np.float64),
        centroid=nodes.centroid,
        background=nodes.background,
        group=fragments.group,
        feature_text_aligned=aligned,
    )


def _features(nodes: NodeTable, fragments: Fragments) -> Array:
    """(n, d) float32 unit rows: those of pieces are the mean of all, by what was said of each and how far it is one."""
    pieced = np.unique(fragments.one)
    if not len(pieced):
        return nodes.feature
    mass = np.bincount(rows_of_sayings(nodes), weights=nodes.saying_weight, minlength=len(nodes))
    seen = np.where(nodes.spoken, mass, 1.0)[pieced, None] * nodes.feature[pieced].astype(np.float64)
    features = nodes.feature.copy()
    features[pieced] = normalize(fragments.among(pieced).pooled(seen))
    return features


def _pieces(nodes: NodeTable, options: GroundedOptions) -> Pieces:
    if (options.fragment_radius_m, options.fragment_cosine) == (RADIUS_M, COSINE):
        return nodes.pieces
    return nodes.find_pieces(options.fragment_radius_m, options.fragment_cosine)


def _vectors(nodes: NodeTable, encode: Encode) -> tuple[Array, Array]:
    """(V, d) float32 of the phrases, and of what they are without their colour; (U,) the rows of the latter."""
    number = {phrase: u for u, phrase in enumerate(nodes.phrases)}
    bare = [without_colour(phrase) for phrase in nodes.phrases]
    missing = sorted(set(bare) - number.keys())
    more = np.asarray(encode(missing), dtype=np.float32) if missing else nodes.phrase_embedding[:0]
    place = number | {phrase: len(number) + k for k, phrase in enumerate(missing)}
    rows = np.array([place[phrase] for phrase in bare], np.int64)
    return np.concatenate([nodes.phrase_embedding, more]), rows
