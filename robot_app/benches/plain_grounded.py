"""The thing's term of the readout `grounded`, object by object in float64: its yardstick, and what it must equal."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from openbelief.arrays import Array
    from openbelief.grounded.options import GroundedOptions
    from openbelief.node_table import NodeTable


def plain_grounded(table: NodeTable, query: Array, best: int) -> list[int]:
    """S = share z(H) + (1 - share) z(<f^v, q>) - cost / sqrt(looks) of a memory whose nodes are no pieces."""
    import numpy as np

    from openbelief.grounded.options import GroundedOptions

    options, unit, among = GroundedOptions(), query / np.linalg.norm(query), np.flatnonzero(~table.background)
    head, seen = np.array([_head(table, i, unit, options) for i in range(len(table))]).T
    looks = np.maximum(np.diff(table.members[1]), 1.0)
    said = (head - head[among].mean()) / max(head[among].std(), options.language_spread)
    look = (seen - seen[among].mean()) / max(seen[among].std(), options.visual_spread)
    score = options.language_share * said + (1 - options.language_share) * look - options.evidence_cost / looks**0.5
    return np.lexsort((np.arange(len(table)), -score))[:best].tolist()


def _head(table: NodeTable, i: int, unit: Array, options: GroundedOptions) -> tuple[float, float]:
    """H and <f^v, q> of a node that somebody spoke of."""
    import numpy as np

    begin, end = table.object_saying_start[i : i + 2]
    names = table.phrase_embedding[table.saying[begin:end]].astype(np.float64)
    feature = table.feature[i].astype(np.float64)
    support = table.saying_weight[begin:end] + options.support_prior
    belief = support**options.support_power * np.exp(options.visual_gain * (names @ feature))
    belief /= belief.sum()
    mean = belief @ names
    consensus = mean @ unit / np.linalg.norm(mean)
    pooled = 1 + options.temperature * np.log(belief @ np.exp((names @ unit - 1) / options.temperature))
    share = options.consensus_share
    return share * consensus + (1 - share) * pooled, float(feature @ unit)
