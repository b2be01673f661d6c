"""What the core knows of perception: these Protocols, nothing more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from openbelief.arrays import Array
from openbelief.observation import Mask, RgbdFrame


class PerceptionFailed(RuntimeError):
    """A perception cannot go on with any frame; the message names the cause and the remedy."""


class FrameUnseen(RuntimeError):
    """A perception could not look at this one frame; the message is the reason. Other frames are not affected."""


@dataclass(frozen=True)
class SegmentedMask:
    """What a segmenter found for a phrase. pixels: (h, w) bool, the frame's size. score in (0, 1]."""

    phrase: str
    score: float
    pixels: Array


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


@runtime_checkable
class PhraseProposer(Protocol):
    """What can be seen, in short noun phrases. It never hears the query."""

    @property
    def id(self) -> str:
        """Names the model, the prompt and the decoding, each with its version."""
        ...

    def propose(self, frame: RgbdFrame) -> list[str]:
        """Distinct phrases, as the model gave them. Raises FrameUnseen where this frame alone gave none."""
        ...


@runtime_checkable
class Segmenter(Protocol):
    """Pixels for phrases."""

    @property
    def id(self) -> str: ...

    def segment(self, frame: RgbdFrame, phrases: Sequence[str]) -> list[SegmentedMask]:
        """Every instance of every phrase, in the order of the phrases; one encoding of the image serves them all."""
        ...


@runtime_checkable
class ImageEncoder(Protocol):
    """Pictures to unit rows."""

    @property
    def id(self) -> str: ...

    @property
    def dim(self) -> int: ...

    @property
    def text_space(self) -> str | None:
        """Id of the TextEncoder whose rows these can be compared with; None where there is none."""
        ...

    def encode(self, images: Sequence[Array]) -> Array:
        """(n, dim) float32 unit rows of n RGB pictures, (h, w, 3) uint8 of any size; batched as the model likes."""
        ...


@runtime_checkable
class SegmentEncoder(Protocol):
    """Segments to unit rows f_e^v: the paper's global-local feature over an ImageEncoder, or recorded ones."""

    @property
    def id(self) -> str: ...

    @property
    def dim(self) -> int: ...

    @property
    def text_space(self) -> str | None: ...

    def encode(self, frame: RgbdFrame, segments: Sequence[SegmentedMask]) -> Array:
        """(m, dim) float32 unit rows, one per segment."""
        ...
