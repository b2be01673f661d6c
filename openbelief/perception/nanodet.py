"""NanoDet: a box detector small enough for any CPU (80 COCO classes, one plain resize, three strides)."""

from __future__ import annotations

import os

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.perception.boxes import SCORE_THRESHOLD, Boxes, survivors
from openbelief.perception.coco_names import COCO_NAMES
from openbelief.perception.composed import BadModelOutput
from openbelief.perception.onnx_session import ModelFileError, OnnxModel

STRIDES = (8, 16, 32)
BGR_MEAN, BGR_STD = (103.53, 116.28, 123.675), (57.375, 57.12, 58.395)


class NanoDet:
    """Boxes of a frame. Outputs are known by their shapes, since exporters name them as they like."""

    def __init__(self, path: str | os.PathLike[str], *, threads: int | None = None) -> None:
        self.names = COCO_NAMES
        self._model = OnnxModel(path, threads=threads)
        self._input, self._side = _square_picture(self._model)
        self._outputs = self._outputs_by_stride()

    @property
    def id(self) -> str:
        return f"{self._model.id} >= {SCORE_THRESHOLD}"

    def detect(self, color: Array) -> Boxes:
        """Boxes of (h, w, 3) uint8 RGB, surest first. Raises BadModelOutput."""
        names = [name for pair in self._outputs.values() for name in pair]
        arrays = self._model.run({self._input: self._picture(color)}, names)
        if not all(np.isfinite(array).all() for array in arrays):
            raise BadModelOutput(f"{self._model.path} gave numbers that are not finite.")
        parts = [
            _decoded(scores[0], edges[0], stride, self._side // stride)
            for stride, scores, edges in zip(self._outputs, arrays[::2], arrays[1::2], strict=True)
        ]
        xyxy, scores = (np.concatenate(part) for part in zip(*parts, strict=True))
        height, width = color.shape[:2]
        xyxy = np.clip(xyxy * np.array([width, height] * 2) / self._side, 0, [width, height] * 2)
        boxes = Boxes(xyxy, scores.max(axis=1), scores.argmax(axis=1))
        whole = (xyxy[:, 2:] > xyxy[:, :2]).all(axis=1) & (boxes.scores >= SCORE_THRESHOLD)
        boxes = boxes.pick(np.flatnonzero(whole))
        return boxes.pick(survivors(boxes))

    def _picture(self, color: Array) -> Array:
        """(1, 3, s, s) float32 BGR, as the network was trained."""
        bgr = cv2.resize(color[..., ::-1], (self._side, self._side)).astype(np.float32)
        mean, std = np.array(BGR_MEAN, np.float32), np.array(BGR_STD, np.float32)
        return ((bgr - mean) / std).transpose(2, 0, 1)[None]

    def _outputs_by_stride(self) -> dict[int, tuple[str, str]]:
        """Stride -> its scores' and its edges' names."""
        by_shape = {shape[1:]: name for name, shape in self._model.output_shapes.items() if len(shape) == 3}
        found = {}
        for stride in STRIDES:
            cells = (self._side // stride) ** 2
            scores = by_shape.get((cells, len(self.names)))
            edges = [name for (n, width), name in by_shape.items() if n == cells and width and width in (32, 44)]
            if scores is None or not edges:
                raise ModelFileError(
                    f"{self._model.path} is another network than NanoDet on {len(self.names)} COCO classes: "
                    f"no scores or edges for its {cells} cells of stride {stride}."
                )
            found[stride] = (scores, edges[0])
        return found


def _square_picture(model: OnnxModel) -> tuple[str, int]:
    """The one input's name and its side in pixels; raises ModelFileError."""
    inputs = [(name, shape) for name, shape in model.input_shapes.items() if len(shape) == 4]
    for name, (_, channels, height, width) in inputs[:1]:
        if len(model.input_shapes) == 1 and channels == 3 and height and height == width and not height % STRIDES[-1]:
            return name, height
    raise ModelFileError(f"{model.path} is another network than NanoDet: its one input should be a square image.")


def _decoded(scores: Array, edges: Array, stride: int, side: int) -> tuple[Array, Array]:
    """((n, 4) boxes in the network's pixels, (n, classes) scores) of the n = side^2 cells of one stride.

    edges: (n, 4 bins) logits over the distances 0, 1, ... strides to the left, top, right and bottom of the centre.
    """
    logits = edges.reshape(len(edges), 4, -1).astype(np.float64)
    shares = np.exp(logits - logits.max(axis=2, keepdims=True))
    shares /= shares.sum(axis=2, keepdims=True)
    reach = shares @ np.arange(shares.shape[2]) * stride
    row, column = np.divmod(np.arange(side * side), side)
    centre = (np.column_stack((column, row)) + 0.5) * stride
    return np.hstack((centre - reach[:, :2], centre + reach[:, 2:])), scores
