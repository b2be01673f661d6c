"""Fixed-vocabulary segmentation under two published protocols that differ: HOV-SG's and DualMap's. Always named.

Both: a ground-truth point takes the majority label of its 5 nearest predicted points, without a distance limit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from openbelief.arrays import Array

if TYPE_CHECKING:
    from openbelief.memory import ObjectMemory

NEIGHBOURS = 5
UNLABELLED = "unlabelled"  # no class: neither predicted nor scored
HOVSG_IGNORED = ("wall", "floor", "door", "window", "background")
DUALMAP_IGNORED = ("wall", "floor", "ceiling", "pillar", "window", "vent", "background")


@dataclass(frozen=True)
class Scores:
    """Of one scene; each in [0, 1]."""

    miou: float
    fmiou: float
    macc: float


@dataclass(frozen=True)
class Protocol:
    """What is ignored, whether ignored ground-truth points stay (and count as false positives), and mIoU's divisor."""

    name: str
    ignores: Callable[[str], bool]
    keeps_ignored_points: bool
    divides_by_union: bool


PROTOCOLS = (
    Protocol("hovsg", lambda name: name in HOVSG_IGNORED, keeps_ignored_points=True, divides_by_union=False),
    Protocol(
        "dualmap",
        lambda name: any(word in name for word in DUALMAP_IGNORED),
        keeps_ignored_points=False,
        divides_by_union=True,
    ),
)


def score(truth: Array, predicted: Array, ignored: Sequence[int], protocol: Protocol) -> Scores:
    """Scores of (n,) predicted class numbers against (n,) true ones; ValueError where nothing is left to score."""
    truth, predicted = np.asarray(truth), np.asarray(predicted)
    of_ignored = np.isin(truth, ignored)
    if of_ignored.all():
        raise ValueError(f"Every ground-truth point is of a class that the {protocol.name} protocol ignores.")
    if not protocol.keeps_ignored_points:
        truth, predicted = truth[~of_ignored], predicted[~of_ignored]
    classes = np.setdiff1d(truth, ignored)
    hits = np.array([np.count_nonzero((truth == c) & (predicted == c)) for c in classes])
    true = np.array([np.count_nonzero(truth == c) for c in classes])
    iou = hits / (true + [np.count_nonzero(predicted == c) for c in classes] - hits)
    divisor = len(np.union1d(truth, predicted)) if protocol.divides_by_union else len(classes)
    return Scores(float(iou.sum() / divisor), float((true * iou).sum() / true.sum()), float((hits / true).mean()))


def transfer(points: Array, labels: Array, truth_points: Array) -> Array:
    """(m,) label of each true point: the majority of its 5 nearest predicted points, ties to the smaller label."""
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(points).query(truth_points, k=list(range(1, min(NEIGHBOURS, len(points)) + 1)))
    votes = labels[nearest]
    counts = (votes[:, :, None] == votes[:, None, :]).sum(axis=2)
    best = counts == counts.max(axis=1, keepdims=True)
    return np.where(best, votes, np.iinfo(votes.dtype).max).min(axis=1)


def predict(memory: ObjectMemory, classes: Sequence[str], readout: str) -> tuple[Array, Array]:
    """(n, 3) points of the map's nodes and (n,) their class numbers, argmax_c of the projection."""
    known = [i for i, name in enumerate(classes) if name != UNLABELLED]
    best = memory.project([classes[i] for i in known], readout).argmax(axis=1)
    points = [node.points for node in memory.objects]
    labels = [np.full(len(p), known[b], dtype=np.int64) for p, b in zip(points, best, strict=True)]
    return np.concatenate(points), np.concatenate(labels)


def evaluate(
    memory: ObjectMemory, classes: Sequence[str], truth_points: Array, truth: Array, readout: str
) -> dict[str, Scores]:
    """Scores by protocol for (m, 3) labelled points, map frame. Raises ValueError on an empty memory."""
    if not memory.objects:
        raise ValueError("The memory holds no objects, so nothing is predicted.")
    labelled = np.array([classes[c] != UNLABELLED for c in truth])
    truth_points, truth = truth_points[labelled], truth[labelled]
    predicted = transfer(*predict(memory, classes, readout), truth_points)
    return {
        protocol.name: score(truth, predicted, [i for i, c in enumerate(classes) if protocol.ignores(c)], protocol)
        for protocol in PROTOCOLS
    }
