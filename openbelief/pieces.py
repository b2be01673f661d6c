"""Nodes that may be pieces of one thing, and how far their points lie together: derived once, kept in the file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from openbelief.arrays import Array
from openbelief.columns import Column
from openbelief.touching_boxes import TouchingBoxes
from openbelief.voxel_share import NearShares

RADIUS_M = 0.05  # points of two nodes nearer than this lie together
COSINE = 0.75  # <f_i^v, f_j^v> of two nodes that may be one thing
CHUNK = 8192  # pairs whose features are compared at once

# F pairs of N objects
PIECE_COLUMNS = {
    "piece_pair": Column("<i4", ("F", 2), below="N"),  # i < j, in lexicographic order
    "piece_share": Column("<f8", ("F",)),  # the larger of the two shares of points within the radius of the other's
}


class Pieces(NamedTuple):
    """pair: (F, 2) int32, i < j, in lexicographic order. share: (F,) float64 in [0, 1]."""

    pair: Array
    share: Array

    def columns(self) -> dict[str, Array]:
        """By their names in PIECE_COLUMNS."""
        return {"piece_pair": self.pair.astype("<i4"), "piece_share": self.share.astype("<f8")}


def find_pieces(
    boxes: Array, features: Array, points: Callable[[int], Array], radius_m: float, cosine: float, voxel_m: float
) -> Pieces:
    """All pairs whose boxes touch when grown by the radius and whose features agree, with the share of their points.

    boxes: (n, 2, 3), map frame, metres. features: (n, d) unit rows. points: of node i, (m, 3); asked only for the nodes
    of such pairs, so the work grows with the pieces and not with the map.
    """
    low, high = boxes[:, 0].astype(np.float64), boxes[:, 1].astype(np.float64)
    near = TouchingBoxes(low, high, radius_m).pairs()
    pair = near[_alike(features, near, cosine)]
    return Pieces(pair.astype(np.int32), _shares(pair, points, radius_m, voxel_m))


def _alike(features: Array, pairs: Array, cosine: float) -> Array:
    """(m,) bool."""
    alike = np.zeros(len(pairs), bool)
    for start in range(0, len(pairs), CHUNK):
        part = slice(start, start + CHUNK)
        one, other = pairs[part].T
        alike[part] = np.einsum("ij,ij->i", features[one], features[other]) >= cosine
    return alike


def _shares(pair: Array, points: Callable[[int], Array], radius_m: float, voxel_m: float) -> Array:
    """(m,) float64: every node's surroundings are drawn once, and all that may lie in them are looked up."""
    if not len(pair):
        return np.zeros(0)
    nodes, numbers = np.unique(pair, return_inverse=True)
    near = NearShares([points(i) for i in nodes.tolist()], radius_m, voxel_m)
    of, around = np.concatenate((numbers.reshape(-1, 2), numbers.reshape(-1, 2)[:, ::-1])).T
    shares = np.empty(len(of))
    order = np.argsort(around, kind="stable")
    for here in _runs(around[order]):
        which = order[here]
        shares[which] = near.shares(of=of[which], near=int(around[which[0]]))
    one, other = shares.reshape(2, -1)
    larger: Array = np.maximum(one, other)
    return larger


def _runs(values: Array) -> Sequence[slice]:
    """Where equal ones lie beside each other."""
    starts = np.flatnonzero(np.append(True, values[1:] != values[:-1])).tolist()
    return [slice(a, b) for a, b in zip(starts, [*starts[1:], len(values)], strict=True)]
