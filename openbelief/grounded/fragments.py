"""Nodes that are pieces of one object: pooled at read time, never joined in the memory."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from openbelief.arrays import Array
from openbelief.pieces import Pieces


@dataclass(frozen=True, eq=False)
class Fragments:
    """one, other, share: (F,) o_ij in (0, 1], each pair both ways round, by `one` and then `other`.

    group: (n,) int64, one number for all pieces of a thing.
    """

    one: Array
    other: Array
    share: Array
    group: Array

    @classmethod
    def of(cls, pieces: Pieces, least_share: float, n: int) -> Fragments:
        """The pieces that overlap enough."""
        kept = pieces.share >= least_share
        pairs, share = pieces.pair[kept].astype(np.int64), pieces.share[kept]
        both, shares = np.concatenate([pairs, pairs[:, ::-1]]), np.concatenate([share, share])
        order = np.lexsort((both[:, 1], both[:, 0]))
        return cls(both[order, 0], both[order, 1], shares[order], _groups(pairs, n))

    def among(self, nodes: Array) -> Fragments:
        """The same for (k,) ascending nodes that hold all pieces of each other, numbered by their places in it."""
        one, other = np.searchsorted(nodes, self.one), np.searchsorted(nodes, self.other)
        return replace(self, one=one, other=other, group=self.group[nodes])

    def pooled(self, values: Array) -> Array:
        """(n, ...) v_i + sum_j o_ij v_j of (n, ...) values."""
        others = np.zeros(values.shape)
        weight = self.share.reshape(-1, *[1] * (values.ndim - 1))
        np.add.at(others, self.one, weight * values[self.other])
        total: Array = values + others
        return total


def _groups(pairs: Array, n: int) -> Array:
    """(n,) the least node of everything that is connected."""
    group = np.arange(n)
    while True:
        before = group.copy()
        least = np.minimum(group[pairs[:, 0]], group[pairs[:, 1]])
        for side in pairs.T:
            np.minimum.at(group, side, least)
        group = group[group]
        if np.array_equal(group, before):
            return group
