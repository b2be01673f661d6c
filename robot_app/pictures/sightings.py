"""Pictures of things as they were seen: a crop with its mask drawn, a view with the thing framed."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from openbelief.acquisition import CROP_MARGIN_PX
from openbelief.arrays import Array
from openbelief.observation import Observation
from openbelief.run_lengths import decode_rle
from openbelief.views import Sighting

MARK_BGR, EDGE_BGR = (63, 210, 255), (60, 48, 34)  # the place's yellow, on ink
JPEG_QUALITY = 80


def crop_with_mask(observation: Observation, side_px: int) -> bytes | None:
    """The crop kept with an observation, JPEG, its longer side `side_px`, with the mask's outline."""
    source = observation.provenance
    image = None if source is None else decoded(source.crop_jpeg)
    if source is None or image is None:
        return None
    scale = side_px / max(image.shape[:2])
    interpolation = cv2.INTER_CUBIC if scale > 1 else cv2.INTER_AREA
    image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=interpolation)
    mask = _mask_of(observation)
    if mask is not None:
        height, width = mask.shape
        x0, y0, x1, y1 = source.bbox
        m = CROP_MARGIN_PX
        part = mask[max(y0 - m, 0) : min(y1 + m, height), max(x0 - m, 0) : min(x1 + m, width)]
        _outline(image, part)
    return encoded(image)


def view_with_thing(picture: bytes, sighting: Sighting | None, masks: Sequence[Observation], side_px: int) -> bytes:
    """A view's JPEG, its longer side at most `side_px`: the masks that are the thing outlined, else its place framed.

    Raises ValueError where the picture cannot be decoded.
    """
    image = decoded(picture)
    if image is None:
        raise ValueError("A view's picture is not a picture.")
    scale = min(1.0, side_px / max(image.shape[:2]))
    if scale < 1:
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    outlines = [mask for mask in map(_mask_of, masks) if mask is not None]
    for mask in outlines:
        _outline(image, mask)
    if not outlines and sighting is not None and sighting.box is not None:
        height, width = image.shape[:2]
        x0, y0, x1, y1 = (round(v) for v in np.array(sighting.box) * [width, height, width, height])
        for colour, thick in ((EDGE_BGR, 4), (MARK_BGR, 2)):
            cv2.rectangle(image, (x0 - 3, y0 - 3), (x1 + 3, y1 + 3), colour, thick)
    return encoded(image)


def decoded(jpeg: bytes | None) -> Array | None:
    """(h, w, 3) uint8 BGR; None where there is none, or it is no picture."""
    return cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR) if jpeg else None


def encoded(image: Array) -> bytes:
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1].tobytes()


def _mask_of(observation: Observation) -> Array | None:
    """(h, w) bool; None where the evidence has none that can be drawn."""
    try:
        return None if observation.provenance is None else decode_rle(observation.provenance.rle)
    except (ValueError, KeyError):
        return None


def _outline(image: Array, mask: Array) -> None:
    """Draws a mask, stretched over the image, as a line on a darker one."""
    if not mask.size or not mask.any():
        return
    height, width = image.shape[:2]
    whole = cv2.resize(mask.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
    outlines, _ = cv2.findContours(whole, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    for colour, thick in ((EDGE_BGR, 4), (MARK_BGR, 2)):
        cv2.drawContours(image, outlines, -1, colour, thick, cv2.LINE_AA)
