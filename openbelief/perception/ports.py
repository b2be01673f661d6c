"""What the core knows of perception: these Protocols, nothing more."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from openbelief.arrays import Array
from openbelief.observation import Mask, RgbdFrame


@runtime_checkable
class TextEncoder(Protocol):
    """Words to unit rows. `id` names the model and its version; it is stored with every memory."""

    @property
    def id(self) -> str: ...

    @property
    def dim(self) -> int: ...

    def encode(self, texts: Sequence[str]) -> Array:
        """(n, dim) float32 unit rows, one per text."""
        ...


@runtime_checkable
class Perception(Protocol):
    """A frame to masks with phrase, confidence and feature. It never hears the query."""

    @property
    def id(self) -> str:
        """Names the models, prompts and versions, for the memory's and the trial's record."""
        ...

    @property
    def feature_text_aligned(self) -> bool:
        """False where features serve association only and cannot be compared with text."""
        ...

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        """The frame's masks, `Mask.index` unique within the frame."""
        ...
