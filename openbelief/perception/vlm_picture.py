"""A frame's colour image as the data URL that OpenAI-compatible servers take."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from openbelief.arrays import Array


@dataclass(frozen=True)
class PictureFormat:
    """max_side_px: larger images are shrunk; Qwen-VL makes a token of 32 x 32 pixels, so this bounds the time."""

    kind: Literal["jpeg", "png"] = "jpeg"
    max_side_px: int = 1024
    jpeg_quality: int = 90

    def __post_init__(self) -> None:
        if self.kind not in ("jpeg", "png") or self.max_side_px < 32 or not 1 <= self.jpeg_quality <= 100:
            raise ValueError(f"A picture is jpeg or png, of 32 pixels or more, of quality 1 to 100; got {self}.")

    def __str__(self) -> str:
        kind = f"jpeg q{self.jpeg_quality}" if self.kind == "jpeg" else "png"
        return f"{kind} <= {self.max_side_px} px"


def data_url(color: Array, picture: PictureFormat) -> str:
    """(h, w, 3) uint8 RGB as "data:image/jpeg;base64,..."."""
    data = base64.b64encode(encoded(color, picture)).decode()
    return f"data:image/{picture.kind};base64,{data}"


def encoded(color: Array, picture: PictureFormat) -> bytes:
    """The file's bytes; the same image gives the same bytes."""
    shrink = picture.max_side_px / max(color.shape[:2])
    if shrink < 1:
        color = cv2.resize(color, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
    bgr = cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2BGR)
    options = [cv2.IMWRITE_JPEG_QUALITY, picture.jpeg_quality] if picture.kind == "jpeg" else []
    return cv2.imencode(f".{picture.kind}", bgr, options)[1].tobytes()
