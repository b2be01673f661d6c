"""SAM 3 through onnxruntime: pixels for phrases, from the three networks that scripts/export/sam3.py wrote."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.observation import RgbdFrame
from openbelief.perception.mask_nms import suppress
from openbelief.perception.model_folder import ModelFolder
from openbelief.perception.picture import PictureTransform
from openbelief.perception.ports import SegmentedMask
from openbelief.perception.prompt_tokens import PromptTokens

SCORE_THRESHOLD = 0.5  # the model's default; on the scale of tau_q
MASK_THRESHOLD = 0.5
PROMPTS_AT_ONCE = 4  # a prompt's masks alone are 66 MB in the decoder
MAPS = ("map_0", "map_1", "map_2")


@dataclass(frozen=True)
class Sam3Instance:
    """One thing found for one phrase. box: (x0, y0, x1, y1) pixels. pixels: (h, w) bool."""

    score: float
    box: tuple[float, float, float, float]
    pixels: Array


class Sam3Segmenter:
    """Segmenter. Raises ModelFolderError where a file or the device is bad."""

    def __init__(self, folder: Path, *, device: str = "auto") -> None:
        model = ModelFolder(Path(folder), "sam3", device)
        self.id = f"sam3:{model.id} score>{SCORE_THRESHOLD}"
        self._transform = PictureTransform.from_dict(model.about["picture"])
        self._tokens = PromptTokens(model.file("tokenizer.json"), model.about["cleaning"])
        self._vision, self._text, self._decoder = (model.network(name) for name in ("vision", "text", "decoder"))

    def segment(self, frame: RgbdFrame, phrases: Sequence[str]) -> list[SegmentedMask]:
        """Every instance of every phrase, in the order of the phrases; the image is encoded once."""
        found = zip(phrases, self.instances(frame.color, phrases), strict=True)
        return suppress([SegmentedMask(phrase, one.score, one.pixels) for phrase, several in found for one in several])

    def instances(self, color: Array, phrases: Sequence[str]) -> list[list[Sam3Instance]]:
        """What was found for each phrase before suppression, in the order of the network's queries."""
        if not phrases:
            return []
        maps = dict(zip(MAPS, self.encode_image(color), strict=True))
        raw = self._decode(maps, phrases)
        return [instances(*one, size=color.shape[:2]) for one in raw]

    def encode_image(self, color: Array) -> list[Array]:
        """The three feature maps, finest first."""
        return list(self._vision.run({"pixel_values": self._transform(color)[None]}))

    def encode_prompts(self, phrases: Sequence[str]) -> dict[str, Array]:
        """`text_features` (n, length, d) and `attention_mask` (n, length) for the decoder."""
        ids, mask = self._tokens(phrases)
        features = self._text.run({"input_ids": ids, "attention_mask": mask})[0]
        return {"text_features": features, "attention_mask": mask}

    def _decode(self, maps: dict[str, Array], phrases: Sequence[str]) -> Iterator[tuple[Array, ...]]:
        """(logits (q,), presence (1,), boxes (q, 4), masks (q, h, w)) of each phrase."""
        for start in range(0, len(phrases), PROMPTS_AT_ONCE):
            prompts = self.encode_prompts(phrases[start : start + PROMPTS_AT_ONCE])
            yield from zip(*self._decoder.run({**maps, **prompts}), strict=True)


def instances(
    logits: Array, presence: Array, boxes: Array, masks: Array, *, size: tuple[int, int]
) -> list[Sam3Instance]:
    """The decoder's output for one phrase as instances in an image of `size` (h, w).

    score = sigmoid(logit) sigmoid(presence); boxes are xyxy in [0, 1]; masks are logits.
    """
    height, width = size
    scores = _sigmoid(logits) * _sigmoid(presence)
    return [
        Sam3Instance(
            float(scores[i]),
            tuple((boxes[i] * [width, height, width, height]).tolist()),
            cv2.resize(_sigmoid(masks[i]), (width, height), interpolation=cv2.INTER_LINEAR) > MASK_THRESHOLD,
        )
        for i in np.flatnonzero(scores > SCORE_THRESHOLD)
    ]


def _sigmoid(x: Array) -> Array:
    return 1.0 / (1.0 + np.exp(-np.clip(x, -80.0, 80.0)))  # beyond, exp overflows float32 with a warning
