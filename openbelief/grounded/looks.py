"""How often a thing was really looked at: three frames within 67 ms are one look (`looks = "moments"`)."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from openbelief.arrays import Array
from openbelief.grounded.options import GroundedOptions
from openbelief.node_table import NodeTable
from openbelief.observation import Observation


def count_looks(nodes: NodeTable, options: GroundedOptions) -> Array:
    """(n,) float64: observations, their distinct frames, or distinct moments of each node, as `options.looks` says.

    Moments need the observations' stamps, so they are read from the file; the other two are in the memory's columns.
    """
    order, start = nodes.members
    if options.looks == "observations":
        return np.diff(start).astype(np.float64)
    if options.looks == "frames":
        return nodes.frames.astype(np.float64)
    seen = nodes.evidence.observations
    members = ([seen[i] for i in order[begin:end].tolist()] for begin, end in pairwise(start))
    return np.array([moments(each, options.moment_s) for each in members], dtype=np.float64)


def moments(observations: Iterable[Observation], apart_s: float) -> int:
    """Frames at least `apart_s` after the last one that counted; a frame of unknown stamp is a moment of its own."""
    frames = {(o.recording, o.provenance.stamp_ns if o.provenance else None, o.frame) for o in observations}
    stamps = sorted((recording, stamp) for recording, stamp, _ in frames if stamp is not None)
    count, last = sum(stamp is None for _, stamp, _ in frames), ("", 0)
    for first, (recording, stamp_ns) in enumerate(stamps):
        if first == 0 or recording != last[0] or stamp_ns - last[1] >= round(apart_s * 1e9):
            count, last = count + 1, (recording, stamp_ns)
    return count
