"""Nodes that are pieces of one object: found and pooled at read time, never joined in the memory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from openbelief.arrays import Array
from openbelief.grounded.options import GroundedOptions
from openbelief.touching_boxes import TouchingBoxes


class Fragments(NamedTuple):
    """overlap: (n, n) scipy sparse, symmetric, o_ij in (0, 1]. group: (n,) int64, one of each thing."""

    overlap: Any
    group: Array


def find_fragments(
    low: Array, high: Array, features: Array, points: Callable[[int], Array], options: GroundedOptions
) -> Fragments:
    """o_ij where boxes touch, <f_i, f_j> and the overlap of the points are large enough; else 0.

    low, high: (n, 3) boxes, map frame, metres. features: (n, d) unit rows. points: of node i, (m, 3); asked only for
    the pairs whose boxes and features agree, so the work grows with the pieces and not with the map.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    n = len(low)
    near = _touching(low, high, options.fragment_radius_m)
    alike = np.einsum("ij,ij->i", features[near[:, 0]], features[near[:, 1]]) >= options.fragment_cosine
    pairs = near[alike]
    shares = np.array([_overlap(points(i), points(j), options.fragment_radius_m) for i, j in pairs])
    kept = shares >= options.fragment_overlap if len(pairs) else np.zeros(0, bool)
    pairs, shares = pairs[kept], shares[kept]
    both = np.concatenate([pairs, pairs[:, ::-1]])
    overlap = coo_matrix((np.concatenate([shares, shares]), (both[:, 0], both[:, 1])), shape=(n, n)).tocsr()
    return Fragments(overlap, connected_components(overlap, directed=False)[1].astype(np.int64))


def _touching(low: Array, high: Array, gap_m: float) -> Array:
    """(m, 2) pairs i < j whose boxes touch when grown by the gap."""
    boxes = TouchingBoxes(low, high, gap_m)
    found = [(others := boxes.of(i))[others > i] for i in range(len(low))]
    first = np.repeat(np.arange(len(low)), [len(others) for others in found])
    return np.stack([first, np.concatenate(found)], axis=1) if len(first) else np.zeros((0, 2), np.int64)


def _overlap(P: Array, Q: Array, radius_m: float) -> float:
    """The larger of the two shares of points within the radius of the other's."""
    from scipy.spatial import cKDTree

    to_q, _ = cKDTree(Q).query(P, distance_upper_bound=radius_m)
    to_p, _ = cKDTree(P).query(Q, distance_upper_bound=radius_m)
    return float(max(np.isfinite(to_q).mean(), np.isfinite(to_p).mean()))
