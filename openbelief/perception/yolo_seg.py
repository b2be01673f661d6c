"""Instance segmentation in the common YOLO-seg layout: boxes with classes, mask coefficients and mask prototypes."""

from __future__ import annotations

import ast
import os
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.perception.boxes import SCORE_THRESHOLD, Boxes, survivors
from openbelief.perception.composed import BadModelOutput
from openbelief.perception.onnx_session import ModelFileError, OnnxModel, Shape
from openbelief.phrase import printable

GREY = 114  # what the letterbox is filled with, as in training
SIDE = 640  # where the export leaves the size open
NAMES_SUFFIX = ".names.txt"


@dataclass(frozen=True)
class Letterbox:
    """How a frame lies in the network's picture: scaled by `scale`, then moved by (left, top) pixels."""

    scale: float
    left: int
    top: int

    def to_frame(self, xyxy: Array, width: int, height: int) -> Array:
        """(n, 4) boxes of the network's picture in the frame's pixels, cut at its edges."""
        moved = (xyxy - [self.left, self.top] * 2) / self.scale
        return np.clip(moved, 0, [width, height] * 2)


@dataclass(frozen=True)
class YoloFound:
    """Detections with what their masks are made of. coefficients: (n, k); prototypes: (k, mh, mw); side: (W, H)."""

    boxes: Boxes
    coefficients: Array
    prototypes: Array
    letterbox: Letterbox
    side: tuple[int, int]


class YoloSeg:
    """An export with a picture (1, 3, H, W) in, and (1, 4 + classes + k, n), (1, k, mh, mw) out, without built-in NMS.

    Class names come from FILE.names.txt (one a line) where it lies beside FILE.onnx, or from the export's metadata.
    Raises ModelFileError.
    """

    def __init__(self, path: str | os.PathLike[str], *, threads: int | None = None) -> None:
        self._model = OnnxModel(path, threads=threads)
        self._input, shape = _only_picture(self._model)
        self._side = int(shape[3] or SIDE), int(shape[2] or SIDE)
        self._outputs, masks = _outputs(self._model)
        self.names = class_names(self._model)
        self._require_columns(masks)

    @property
    def id(self) -> str:
        return f"{self._model.id} >= {SCORE_THRESHOLD}"

    def detect(self, color: Array) -> YoloFound:
        """What is in (h, w, 3) uint8 RGB, surest first. Raises BadModelOutput."""
        picture, letterbox = letterboxed(color, self._side)
        rows, prototypes = self._model.run({self._input: picture[None].astype(np.float32) / 255}, self._outputs)
        rows, prototypes = rows[0].T.astype(np.float32), prototypes[0].astype(np.float32)
        if not (np.isfinite(rows).all() and np.isfinite(prototypes).all()):
            raise BadModelOutput(f"{self._model.path} gave numbers that are not finite.")
        classes = rows[:, 4 : 4 + len(self.names)]
        half = rows[:, 2:4] / 2
        xyxy = letterbox.to_frame(np.hstack((rows[:, :2] - half, rows[:, :2] + half)), color.shape[1], color.shape[0])
        boxes = Boxes(xyxy, classes.max(axis=1), classes.argmax(axis=1))
        likely = np.flatnonzero((boxes.scores >= SCORE_THRESHOLD) & (xyxy[:, 2:] > xyxy[:, :2]).all(axis=1))
        kept = likely[survivors(boxes.pick(likely))]
        coefficients = rows[kept, 4 + len(self.names) :]
        return YoloFound(boxes.pick(kept), coefficients, prototypes, letterbox, self._side)

    def _require_columns(self, masks: int) -> None:
        columns = self._model.output_shapes[self._outputs[0]][1]
        expected = 4 + len(self.names) + masks
        if columns is not None and columns != expected:
            raise ModelFileError(
                f"{self._model.path} gives {columns} numbers a box; 4 edges, {len(self.names)} class names and {masks} "
                f"mask coefficients make {expected}: give it the {columns - 4 - masks} names that it was trained with."
            )


def masks_of(found: YoloFound, shape: tuple[int, int]) -> list[Array]:
    """One (h, w) bool mask per box: sigmoid(coefficients x prototypes) > 0.5, at the frame's resolution, in the box."""
    k, mh, mw = found.prototypes.shape
    logits = (found.coefficients @ found.prototypes.reshape(k, -1)).reshape(-1, mh, mw)
    height, width = shape
    # Frame pixel centres -> prototype pixel centres.
    box = found.letterbox
    sx, sy = mw / found.side[0], mh / found.side[1]
    to_prototype = np.array(
        [
            [box.scale * sx, 0, (0.5 * box.scale + box.left) * sx - 0.5],
            [0, box.scale * sy, (0.5 * box.scale + box.top) * sy - 0.5],
        ]
    )
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    masks = []
    for logit, (x0, y0, x1, y1) in zip(logits, np.rint(found.boxes.xyxy).astype(int), strict=True):
        whole = cv2.warpAffine(logit, to_prototype, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE)
        pixels = np.zeros((height, width), dtype=bool)
        pixels[y0:y1, x0:x1] = whole[y0:y1, x0:x1] > 0  # sigmoid(0) = 0.5
        masks.append(pixels)
    return masks


def letterboxed(color: Array, side: tuple[int, int]) -> tuple[Array, Letterbox]:
    """(3, H, W) uint8: the frame scaled to fit `side` (W, H) with its aspect kept, centred on grey."""
    height, width = color.shape[:2]
    scale = min(side[0] / width, side[1] / height)
    inner = min(round(width * scale), side[0]), min(round(height * scale), side[1])
    left, top = (side[0] - inner[0]) // 2, (side[1] - inner[1]) // 2
    picture = np.full((side[1], side[0], 3), GREY, dtype=np.uint8)
    picture[top : top + inner[1], left : left + inner[0]] = cv2.resize(color, inner, interpolation=cv2.INTER_LINEAR)
    return picture.transpose(2, 0, 1), Letterbox(scale, left, top)


def class_names(model: OnnxModel) -> tuple[str, ...]:
    """From the file beside the model, then from its metadata; raises ModelFileError where neither has any."""
    beside = model.path.with_name(model.path.stem + NAMES_SUFFIX)
    if beside.is_file():
        lines = beside.read_text(encoding="utf-8", errors="replace").splitlines()
        names = [printable(line) for line in lines if line.strip()]
    else:
        names = _metadata_names(model, beside)
    if not names:
        raise ModelFileError(f"{model.path} has no class names: write them into {beside}, one a line.")
    return tuple(names)


def _metadata_names(model: OnnxModel, beside: Path) -> list[str]:
    """ "{0: 'person', 1: 'bicycle'}", read as a literal and never run."""
    try:
        named = ast.literal_eval(model.metadata.get("names", "{}"))
        return [printable(str(named[index])) for index in range(len(named))]
    except (ValueError, SyntaxError, KeyError, TypeError, MemoryError, RecursionError) as error:
        raise ModelFileError(
            f"{model.path} has class names that cannot be read: write them into {beside}, one a line."
        ) from error


def _only_picture(model: OnnxModel) -> tuple[str, Shape]:
    inputs = list(model.input_shapes.items())
    if len(inputs) != 1 or len(inputs[0][1]) != 4 or inputs[0][1][1] not in (3, None):
        raise ModelFileError(f"{model.path} is no YOLO-seg export: its one input should be a picture [1, 3, H, W].")
    return inputs[0]


def _outputs(model: OnnxModel) -> tuple[list[str], int]:
    """([boxes, prototypes], number of mask coefficients)."""
    boxes = [name for name, shape in model.output_shapes.items() if len(shape) == 3]
    prototypes = [name for name, shape in model.output_shapes.items() if len(shape) == 4]
    if len(boxes) != 1 or len(prototypes) != 1 or not (k := model.output_shapes[prototypes[0]][1]):
        raise ModelFileError(
            f"{model.path} is no YOLO-seg export: it should give boxes [1, 4 + classes + k, n] and mask prototypes "
            "[1, k, h, w]. Export the segmentation model, without built-in NMS."
        )
    return [boxes[0], prototypes[0]], k
