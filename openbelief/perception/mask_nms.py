"""Non-maximum suppression of masks: of two that cover the same pixels under one phrase, the surer one stays."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from openbelief.arrays import Array
from openbelief.perception.ports import SegmentedMask

NMS_IOU = 0.8


def suppress(segments: Sequence[SegmentedMask], iou: float = NMS_IOU) -> list[SegmentedMask]:
    """The segments that stay, in their order. Two phrases for the same pixels both stay: both are evidence."""
    by_phrase: dict[str, list[int]] = defaultdict(list)
    for index, segment in enumerate(segments):
        by_phrase[segment.phrase].append(index)
    kept = {index for group in by_phrase.values() for index in _survivors(segments, group, iou)}
    return [segment for index, segment in enumerate(segments) if index in kept]


def _survivors(segments: Sequence[SegmentedMask], group: list[int], iou: float) -> list[int]:
    """Of one phrase's segments, surest first; ties by order."""
    order = sorted(group, key=lambda index: -segments[index].score)
    overlaps = mask_iou(np.stack([segments[index].pixels for index in order]))
    kept: list[int] = []
    for row in range(len(order)):
        if all(overlaps[row, other] <= iou for other in kept):
            kept.append(row)
    return [order[row] for row in kept]


def mask_iou(masks: Array) -> Array:
    """(m, m) intersection over union of (m, h, w) bool masks; two empty masks have 0."""
    flat = masks.reshape(len(masks), -1).astype(np.float32)
    shared = flat @ flat.T
    areas = np.diag(shared)
    union = areas[:, None] + areas[None, :] - shared
    return np.divide(shared, union, out=np.zeros_like(shared), where=union > 0)
