"""The map as matrices: phrases, beliefs, features and boxes of every node, fragments pooled. Made once, read often."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from openbelief.arrays import Array, normalize
from openbelief.grounded.colours import colours_of, without_colour
from openbelief.grounded.fragments import Fragments
from openbelief.grounded.lexicon import is_known
from openbelief.grounded.looks import count_looks
from openbelief.grounded.options import GroundedOptions
from openbelief.node_table import NodeTable
from openbelief.pieces import COSINE, RADIUS_M, Pieces

Encode = Callable[[Sequence[str]], Array]  # (n, d) float64 unit rows
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


def map_table(nodes: NodeTable, encode: Encode, options: GroundedOptions) -> MapTable:
    """Everything that no query changes. encode: embeds phrases that lose a colour word; the rest is in the memory."""
    fragments = Fragments.of(_pieces(nodes, options), options.fragment_overlap, len(nodes))
    entries = _pooled(nodes, fragments)
    pooled = normalize(fragments.pooled(_mass(nodes)[:, None] * nodes.feature.astype(np.float64))).astype(np.float32)
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
        looks=fragments.pooled(count_looks(nodes, options)),
        low=nodes.aabb[:, 0].astype(np.float64),
        high=nodes.aabb[:, 1].astype(np.float64),
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


def _pieces(nodes: NodeTable, options: GroundedOptions) -> Pieces:
    if (options.fragment_radius_m, options.fragment_cosine) == (RADIUS_M, COSINE):
        return nodes.pieces
    return nodes.find_pieces(options.fragment_radius_m, options.fragment_cosine)


def _pooled(nodes: NodeTable, fragments: Fragments) -> tuple[Array, Array, Array]:
    """(E,) row, phrase and V_i + sum_j o_ij V_j of every entry, by row and then phrase."""
    start = nodes.object_saying_start
    count = np.diff(start)[fragments.other]  # what every piece lends
    lent = np.repeat(start[fragments.other] - (np.cumsum(count) - count), count) + np.arange(count.sum())
    P = max(len(nodes.phrases), 1)
    own_key = _rows(nodes) * P + nodes.saying
    lent_key = np.repeat(fragments.one, count) * P + nodes.saying[lent]
    keys, place = np.unique(np.concatenate((own_key, lent_key)), return_inverse=True)
    support = np.bincount(place[: len(own_key)], weights=nodes.saying_weight, minlength=len(keys))
    shared = np.repeat(fragments.share, count) * nodes.saying_weight[lent]
    support += np.bincount(place[len(own_key) :], weights=shared, minlength=len(keys))
    row, phrase = np.divmod(keys, P)
    return row, phrase, support


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
    row, phrase, _ = entries
    lengths, starts = np.zeros(n), np.flatnonzero(np.append(True, row[1:] != row[:-1])) if len(row) else row
    for first in range(0, len(starts), CHUNK):
        mine = np.append(starts, len(row))[first : first + CHUNK + 1]
        part = slice(mine[0], mine[-1])
        sums = np.add.reduceat(belief[part, None] * vectors[phrase[part]], mine[:-1] - mine[0])
        lengths[row[mine[:-1]]] = np.linalg.norm(sums, axis=1)
    return lengths
