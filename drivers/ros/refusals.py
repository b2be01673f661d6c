"""Why an image or a calibration cannot be used: one word for all of its kind, and one image's detail."""

from __future__ import annotations

from enum import StrEnum


class ImageReason(StrEnum):
    """What is wrong, the same for all of its kind."""

    COLOR_ENCODING = "colour encoding not supported"
    DEPTH_ENCODING = "depth encoding not supported"
    MALFORMED = "image is malformed"
    SIZES = "sizes differ"
    NO_CALIBRATION = "camera info is not a calibration"
    DISTORTION = "distortion model not supported"
    RECTIFICATION = "rectified image without its projection"


class ImageRefused(ValueError):
    """An image or a calibration cannot be used. `reason` is short and the same for all of its kind."""

    def __init__(self, reason: ImageReason, detail: str) -> None:
        super().__init__(detail)
        self.reason = reason
