"""A mask as COCO run lengths, and the box around it."""

from __future__ import annotations

from typing import TypedDict

import numpy as np

from openbelief.arrays import Array


class Rle(TypedDict):
    """COCO uncompressed run lengths of a mask: column-major, the first count is background."""

    size: list[int]  # [height, width]
    counts: list[int]


def encode_rle(pixels: Array, bbox: tuple[int, int, int, int] | None = None) -> Rle:
    """COCO uncompressed run lengths of an (h, w) bool mask; only the box around it, where it is known, is walked."""
    mask = np.asarray(pixels, dtype=bool)
    height, size = mask.shape[0], mask.size
    if bbox is None and not mask.any():
        return {"size": list(mask.shape), "counts": [size] if size else []}
    x0, y0, x1, y1 = bbox or mask_bbox(mask)
    columns = np.zeros((x1 - x0, y1 - y0 + 1), bool)  # with a pixel below each, so that a run ends with its column
    columns[:, :-1] = mask[y0:y1, x0:x1].T
    flat = columns.ravel()
    edges = np.flatnonzero(np.concatenate((flat[:1], flat[1:] != flat[:-1])))
    column, row = np.divmod(edges, columns.shape[1])
    edges = (x0 + column) * height + y0 + row
    parted = np.flatnonzero(edges[1:-1:2] == edges[2::2])  # columns of full height go on in the next
    edges = np.delete(edges, np.concatenate((2 * parted + 1, 2 * parted + 2)))
    ends = [] if edges[-1] == size else [size]
    return {"size": list(mask.shape), "counts": np.diff(np.concatenate(([0], edges, ends))).astype(int).tolist()}


def decode_rle(rle: Rle) -> Array:
    """(h, w) bool mask; raises ValueError where the counts do not fill the size exactly."""
    height, width = (int(n) for n in rle["size"])
    counts = np.asarray(rle["counts"], dtype=np.int64)
    if height <= 0 or width <= 0 or height * width > 1 << 26:
        raise ValueError(f"RLE size [{height}, {width}] is out of range.")
    if counts.ndim != 1 or (counts < 0).any() or counts.sum() != height * width:
        raise ValueError(f"RLE counts should be non-negative and fill {height}x{width} pixels.")
    pixels = np.zeros(height * width, bool)
    runs = counts[1 : len(counts) // 2 * 2]  # from the first to the last of the thing's
    begin = int(counts[:1].sum())
    pixels[begin : begin + int(runs.sum())] = np.repeat(np.arange(len(runs)) % 2 == 0, runs)
    return pixels.reshape((height, width), order="F")


def mask_bbox(pixels: Array) -> tuple[int, int, int, int]:
    """(x0, y0, x1, y1), end exclusive, of a non-empty (h, w) bool mask."""
    rows = np.flatnonzero(pixels.any(axis=1))
    if not len(rows):
        raise ValueError("An empty mask has no bounding box.")
    y0, y1 = int(rows[0]), int(rows[-1]) + 1
    columns = np.flatnonzero(pixels[y0:y1].any(axis=0))
    return int(columns[0]), y0, int(columns[-1]) + 1, y1
