"""A frame's colour image as the data URL that OpenAI-compatible servers take."""

from __future__ import annotations

import base64

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.perception.vlm_config import PictureFormat


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
