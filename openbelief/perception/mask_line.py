"""One line of a *.perception.jsonl file: a mask with its words and its feature, checked when read."""

from __future__ import annotations

import base64
import binascii
import math
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from openbelief.arrays import Array, unit_vector
from openbelief.observation import Mask
from openbelief.run_lengths import Rle, decode_rle, encode_rle, mask_bbox
from openbelief.settings import first_complaint

FORMAT = "openbelief.perception/1"
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Header(BaseModel):
    """The first line. What else it says (models, notes) is kept."""

    model_config = ConfigDict(extra="allow", frozen=True)

    format: Literal["openbelief.perception/1"]
    feature_dim: Annotated[int, Field(ge=1, le=65536)]
    feature_dtype: Literal["float16"] = "float16"
    text_space: str | None = None  # id of the text encoder whose space the features live in
    feature_text_aligned: bool = True


class RleLine(BaseModel):
    size: Annotated[list[Annotated[int, Field(ge=1, le=1 << 14)]], Field(min_length=2, max_length=2)]
    counts: list[Annotated[int, Field(ge=0)]]


class MaskLine(BaseModel):
    """Every other line. `masks_in_frame` is written by our own cache: a frame with fewer lines was cut off."""

    model_config = ConfigDict(strict=True)

    stamp_ns: Annotated[int, Field(ge=0, lt=1 << 63)]
    mask_index: Annotated[int, Field(ge=0)]
    phrase: str | None
    confidence: Annotated[float, Field(gt=0, le=1)]
    bbox: Annotated[list[Finite], Field(min_length=4, max_length=4)]
    rle: RleLine
    feature: str
    masks_in_frame: int | None = None

    def mask(self, feature_dim: int) -> Mask:
        """Raises ValueError where the run lengths do not fill the image or the feature is not a unit vector."""
        rle: Rle = {"size": self.rle.size, "counts": self.rle.counts}
        return Mask(self.mask_index, decode_rle(rle), self.phrase, self.confidence, self.unit_feature(feature_dim))

    def unit_feature(self, feature_dim: int) -> Array:
        """(feature_dim,) float32 of unit length."""
        try:
            data = base64.b64decode(self.feature, validate=True)
        except binascii.Error as error:
            raise ValueError(f"feature is not base64: {error}") from error
        if len(data) != 2 * feature_dim:
            raise ValueError(
                f"feature should be {feature_dim} float16 ({2 * feature_dim} bytes), got {len(data)} bytes"
            )
        return unit_vector(np.frombuffer(data, "<f2").astype(np.float32))

    def check(self, feature_dim: int) -> None:
        """What the types cannot say; raises ValueError. Cheaper than `mask`, which makes the pixels too."""
        if sum(self.rle.counts) != math.prod(self.rle.size):
            raise ValueError(f"rle counts should fill {self.rle.size[0]}x{self.rle.size[1]} pixels")
        self.unit_feature(feature_dim)


def line_of(stamp_ns: int, mask: Mask, masks_in_frame: int) -> MaskLine:
    """The line that reads back as this mask (its feature rounded to float16)."""
    pixels = np.asarray(mask.pixels, dtype=bool)
    rle = encode_rle(pixels)
    return MaskLine(
        stamp_ns=stamp_ns,
        mask_index=mask.index,
        phrase=mask.phrase,
        confidence=float(mask.confidence),
        bbox=[float(edge) for edge in (mask_bbox(pixels) if pixels.any() else (0, 0, 0, 0))],
        rle=RleLine(size=rle["size"], counts=rle["counts"]),
        feature=base64.b64encode(np.asarray(mask.feature, "<f2").tobytes()).decode(),
        masks_in_frame=masks_in_frame,
    )


def one_line(error: ValueError) -> str:
    """The first thing that is wrong, in one line: "confidence: Input should be less than or equal to 1"."""
    return first_complaint(error) if isinstance(error, ValidationError) else str(error)
