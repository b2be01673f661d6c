"""CLIP through onnxruntime: any open_clip architecture that scripts/export/clip.py wrote; MobileCLIP2-S4 first.

clip = Clip(Path("models/mobileclip2-s4"))
clip.text.encode(["red chair"]) @ clip.images.encode([color]).T
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from openbelief.arrays import Array, normalize
from openbelief.perception.model_folder import ModelFolder
from openbelief.perception.picture import PictureTransform
from openbelief.perception.prompt_tokens import PromptTokens

TEMPLATES = ("{}", "There is the {} in the scene.")  # HOV-SG
IMAGE_BATCH = 16
TEXT_BATCH = 32


class Clip:
    """Both encoders of one folder; they share a space. Raises ModelFolderError where a file or the device is bad."""

    def __init__(self, folder: Path, *, device: str = "auto") -> None:
        self._folder = ModelFolder(Path(folder), "clip", device)
        self._folder.about  # noqa: B018  a wrong folder is refused here, not at the first frame

    @cached_property
    def text(self) -> ClipTextEncoder:
        return ClipTextEncoder(self._folder)

    @cached_property
    def images(self) -> ClipImageEncoder:
        return ClipImageEncoder(self._folder)


class ClipTextEncoder:
    """TextEncoder: the mean of the templates' unit rows, normalised. Every text is encoded once."""

    def __init__(self, folder: ModelFolder) -> None:
        self.id = text_space(folder)
        self.dim = int(folder.about["dim"])
        self._tokens = PromptTokens(folder.file("tokenizer.json"), folder.about["cleaning"])
        self._network = folder.network("text")
        self._known: dict[str, Array] = {}

    def encode(self, texts: Sequence[str]) -> Array:
        """(n, dim) float32 unit rows."""
        missing = [text for text in dict.fromkeys(texts) if text not in self._known]
        for start in range(0, len(missing), TEXT_BATCH):
            batch = missing[start : start + TEXT_BATCH]
            self._known.update(zip(batch, self._embed(batch), strict=True))
        return np.array([self._known[text] for text in texts], dtype=np.float32).reshape(len(texts), self.dim)

    def _embed(self, texts: list[str]) -> Array:
        prompts = [template.replace("{}", text) for text in texts for template in TEMPLATES]
        ids, _ = self._tokens(prompts)
        rows = normalize(self._network.run({"input_ids": ids})[0].astype(np.float64))
        return normalize(rows.reshape(len(texts), len(TEMPLATES), self.dim).mean(axis=1))


class ClipImageEncoder:
    """ImageEncoder; pictures go through in batches of at most IMAGE_BATCH."""

    def __init__(self, folder: ModelFolder) -> None:
        self.id = f"clip-image:{folder.id}"
        self.dim = int(folder.about["dim"])
        self.text_space: str | None = text_space(folder)
        self._transform = PictureTransform.from_dict(folder.about["picture"])
        self._network = folder.network("image")

    def encode(self, images: Sequence[Array]) -> Array:
        """(n, dim) float32 unit rows of n RGB pictures, (h, w, 3) uint8."""
        starts = range(0, len(images), IMAGE_BATCH)
        rows = [self._embed(images[start : start + IMAGE_BATCH]) for start in starts]
        return np.concatenate([np.zeros((0, self.dim)), *rows]).astype(np.float32)

    def _embed(self, images: Sequence[Array]) -> Array:
        pixels = np.stack([self._transform(image) for image in images])
        return normalize(self._network.run({"pixel_values": pixels})[0].astype(np.float64))


def text_space(folder: ModelFolder) -> str:
    """The text encoder's id: architecture, weights, precision, templates."""
    return f"clip:{folder.id} templates={'|'.join(TEMPLATES)}"
