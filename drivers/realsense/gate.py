"""Duplicate images: a frame that repeats a number, a stamp or its pixels is refused and counted."""

from __future__ import annotations

import numpy as np

from drivers.realsense.messages import ImagePair
from openbelief.arrays import Array


class DuplicateFilter:
    """Remembers the last image, and counts. lost: colour images whose numbers never came."""

    def __init__(self) -> None:
        self.frames = self.lost = self.frozen = 0
        self._last: ImagePair | None = None

    def admit(self, pair: ImagePair) -> bool:
        """Whether this image tells anything that the last one did not."""
        last = self._last
        if last is not None and (_repeated(last, pair) or _same_pixels(last, pair)):
            self.frozen += 1
            return False
        self.frames += 1
        self.lost += 0 if last is None else pair.color_number - last.color_number - 1
        self._last = pair
        return True


def _repeated(last: ImagePair, pair: ImagePair) -> bool:
    """A number that does not grow, or a stamp that stands still, on either imager."""
    return (
        pair.color_number <= last.color_number
        or pair.depth_number <= last.depth_number
        or pair.device_stamp_ns == last.device_stamp_ns
        or pair.depth_device_stamp_ns == last.depth_device_stamp_ns
    )


def _same_pixels(last: ImagePair, pair: ImagePair) -> bool:
    """Either image equals its predecessor. A sensor's noise forbids that, except on a blank image (a covered lens)."""
    return any(
        _same(before, now) and not _blank(now) for before, now in ((last.depth, pair.depth), (last.color, pair.color))
    )


def _same(before: Array, now: Array) -> bool:
    """The middle row first: it differs almost always, and costs nothing."""
    middle = len(now) // 2
    return bool(np.array_equal(before[middle], now[middle]) and np.array_equal(before, now))


def _blank(image: Array) -> bool:
    return bool((image == image.flat[0]).all())
