"""What is said of each node, its pieces pooled: an entry for every phrase of a node, with support, belief, length."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from openbelief.arrays import Array
from openbelief.grounded.fragments import Fragments
from openbelief.grounded.options import GroundedOptions
from openbelief.node_table import NodeTable

AT_ONCE = 1024  # products of rows: what passes through stays in the processor's cache
GRAM_MAX = 2048  # phrases: all their products with each other are 32 MB, and made faster than those that are asked for


class Entries(NamedTuple):
    """(E,) each, by row and then phrase. row: the node. support: V_i + sum_j o_ij V_j."""

    row: Array
    phrase: Array
    support: Array


def rows_of_sayings(nodes: NodeTable) -> Array:
    """(Q,) the node of every saying."""
    return np.repeat(np.arange(len(nodes)), np.diff(nodes.object_saying_start))


def pooled_entries(nodes: NodeTable, fragments: Fragments) -> Entries:
    """What is said of a node, and by their share what is said of its pieces."""
    start = nodes.object_saying_start
    count = np.diff(start)[fragments.other]  # what every piece lends
    lent = np.repeat(start[fragments.other] - (np.cumsum(count) - count), count) + np.arange(count.sum())
    P = max(len(nodes.phrases), 1)
    own_key = rows_of_sayings(nodes) * P + nodes.saying
    lent_key = np.repeat(fragments.one, count) * P + nodes.saying[lent]
    keys, place = np.unique(np.concatenate((own_key, lent_key)), return_inverse=True)
    support = np.bincount(place[: len(own_key)], weights=nodes.saying_weight, minlength=len(keys))
    shared = np.repeat(fragments.share, count) * nodes.saying_weight[lent]
    support += np.bincount(place[len(own_key) :], weights=shared, minlength=len(keys))
    row, phrase = np.divmod(keys, P)
    return Entries(row, phrase, support)


def beliefs(entries: Entries, vectors: Array, features: Array | None, options: GroundedOptions) -> Array:
    """(E,) p_p ~ (V_p + prior)^power exp(gain <g_p, f^v>), summing to 1 over each node; None: without the gain."""
    row, phrase, support = entries
    n = int(row.max(initial=-1)) + 1
    logs = options.support_power * np.log(support + options.support_prior)
    if features is not None:
        several = np.flatnonzero(np.bincount(row, minlength=n)[row] > 1)  # what is said alone is believed
        logs[several] += options.visual_gain * _products(vectors, phrase[several], features, row[several])
    most = np.full(n, -np.inf)
    np.maximum.at(most, row, logs)
    raw = np.exp(logs - most[row])
    shares: Array = raw / np.bincount(row, weights=raw, minlength=n)[row]
    return shares


Product = Callable[[Array, Array], Array]  # (k,) <g_a, g_b> for two (k,) numbers of phrases


def lengths(entries: Entries, belief: Array, product: Product, n: int) -> Array:
    """(n,) |sum_p p g_p| of each node, by the products of its phrases with each other."""
    row, phrase, _ = entries
    square = np.zeros(n)
    one = other = np.arange(len(row))
    while len(one):
        twice = 1.0 if other[0] == one[0] else 2.0
        weights = twice * belief[one] * belief[other] * product(phrase[one], phrase[other])
        square += np.bincount(row[one], weights=weights, minlength=n)
        one, other = one[other + 1 < len(row)], other[other + 1 < len(row)] + 1
        same = row[one] == row[other]
        one, other = one[same], other[same]
    return np.sqrt(np.maximum(square, 0.0))


def product_of(vectors: Array) -> Product:
    """Of (U, d) rows."""
    if len(vectors) > GRAM_MAX:
        return lambda one, other: _products(vectors, one, vectors, other, np.float64)
    exact = vectors.astype(np.float64)
    gram = exact @ exact.T
    return lambda one, other: gram[one, other]


def _products(a: Array, of_a: Array, b: Array, of_b: Array, dtype: type[np.floating] = np.float32) -> Array:
    """(k,) float64 products of (k,) rows of a with (k,) rows of b, worked out in `dtype`."""
    out = np.empty(len(of_a))
    for start in range(0, len(of_a), AT_ONCE):
        part = slice(start, start + AT_ONCE)
        out[part] = np.einsum("ed,ed->e", a[of_a[part]], b[of_b[part]], dtype=dtype)
    return out
