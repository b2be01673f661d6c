"""The pixels of the thing in a box: a salient-object network looks at the box, then depth cuts off what is behind."""

from __future__ import annotations

import os

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.perception.network_input import IMAGENET, network_input
from openbelief.perception.onnx_session import OnnxModel

SIDE = 320
PADDING = 0.15  # of the box's size: a thing that fills its picture is not salient
THRESHOLD = 0.5
DEPTH_REACH_M = 0.4  # a chair is not deeper; the wall behind it is farther
DEPTH_BIN_M = 0.1
INPUT, OUTPUT = "input.1", "1959"


class SalientBoxMask:
    """U-2-Net (u2netp) as a box-prompted segmenter."""

    def __init__(self, path: str | os.PathLike[str], *, threads: int | None = None) -> None:
        shapes = {INPUT: (1, 3, SIDE, SIDE)}, {OUTPUT: (1, 1, SIDE, SIDE)}
        self._model = OnnxModel(path, inputs=shapes[0], outputs=shapes[1], threads=threads)

    @property
    def id(self) -> str:
        return f"{self._model.id} in the box + {PADDING:.0%}, depth mode +- {DEPTH_REACH_M} m"

    def mask(self, color: Array, depth_m: Array, box: Array) -> Array:
        """(h, w) bool: within `box` (x0, y0, x1, y1), the largest connected part; empty where nothing stands out."""
        height, width = color.shape[:2]
        pad = PADDING * np.array([box[2] - box[0], box[3] - box[1]])
        x0, y0, x1, y1 = whole_pixels(np.hstack((box[:2] - pad, box[2:] + pad)), width, height)
        pixels = np.zeros((height, width), dtype=bool)
        pixels[y0:y1, x0:x1] = self._salient(color[y0:y1, x0:x1])
        inside = np.zeros_like(pixels)
        x0, y0, x1, y1 = whole_pixels(box, width, height)
        inside[y0:y1, x0:x1] = True
        return largest_part(near_depth_mode(pixels & inside, depth_m))

    def _salient(self, crop: Array) -> Array:
        """(h, w) bool of an (h, w, 3) uint8 crop; the network's answer is relative, so it is stretched to [0, 1]."""
        picture = network_input(crop, SIDE, IMAGENET, white=max(int(crop.max()), 1))
        answer = self._model.run({INPUT: picture[None]}, [OUTPUT])[0][0, 0].astype(np.float32)
        low, high = float(answer.min()), float(answer.max())
        if not high > low:  # also where it is not finite
            return np.zeros(crop.shape[:2], dtype=bool)
        return cv2.resize((answer - low) / (high - low), crop.shape[1::-1]) > THRESHOLD


def whole_pixels(box: Array, width: int, height: int) -> tuple[int, int, int, int]:
    """(x0, y0, x1, y1), end exclusive, within the image, at least one pixel; edges are rounded to the nearest."""
    x0, y0 = (min(max(round(float(edge)), 0), size - 1) for edge, size in zip(box[:2], (width, height), strict=True))
    x1, y1 = (min(round(float(edge)), size) for edge, size in zip(box[2:], (width, height), strict=True))
    return x0, y0, max(x1, x0 + 1), max(y1, y0 + 1)


def near_depth_mode(pixels: Array, depth_m: Array) -> Array:
    """The pixels whose depth is near the most frequent one, and those without depth."""
    seen = depth_m[pixels & (depth_m > 0)]
    if not len(seen):
        return pixels
    bins = (seen / DEPTH_BIN_M).astype(int)
    mode_m = (np.bincount(bins).argmax() + 0.5) * DEPTH_BIN_M
    return pixels & ((depth_m == 0) | (np.abs(depth_m - mode_m) <= DEPTH_REACH_M))


def largest_part(pixels: Array) -> Array:
    """The largest 8-connected part of an (h, w) bool mask."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(pixels.astype(np.uint8), connectivity=8)
    if count < 2:
        return pixels
    return labels == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
