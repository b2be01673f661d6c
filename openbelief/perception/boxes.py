"""Boxes that detectors find, and which of them stay."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array

# As kitchen.perception.jsonl was made: below this score NanoDet-m mostly sees what is not there.
SCORE_THRESHOLD = 0.35
NMS_IOU = 0.5


@dataclass(frozen=True)
class Boxes:
    """n detections. xyxy: (n, 4) float pixels of the frame; scores: (n,) in (0, 1]; classes: (n,) int."""

    xyxy: Array
    scores: Array
    classes: Array

    def __len__(self) -> int:
        return len(self.scores)

    def pick(self, rows: Array) -> Boxes:
        return Boxes(self.xyxy[rows], self.scores[rows], self.classes[rows])


def survivors(boxes: Boxes) -> Array:
    """Rows that non-maximum suppression within each class leaves, surest first; ties by order."""
    kept: list[int] = []
    for row in np.argsort(-boxes.scores, kind="stable"):
        rivals = [k for k in kept if boxes.classes[k] == boxes.classes[row]]
        if not rivals or box_iou(boxes.xyxy[rivals], boxes.xyxy[row]).max() <= NMS_IOU:
            kept.append(int(row))
    return np.array(kept, dtype=int)


def box_iou(many: Array, one: Array) -> Array:
    """(n,) intersection over union of (n, 4) boxes with one."""
    low, high = np.maximum(many[:, :2], one[:2]), np.minimum(many[:, 2:], one[2:])
    shared = np.prod(np.clip(high - low, 0, None), axis=1)
    areas = np.prod(many[:, 2:] - many[:, :2], axis=1) + np.prod(one[2:] - one[:2])
    return shared / np.maximum(areas - shared, 1e-9)
