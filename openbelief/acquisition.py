"""From a frame and its masks to observations (paper Sec. III-B); what cannot be used is refused by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.backprojection import backproject
from openbelief.clustering import largest_cluster
from openbelief.observation import Mask, Observation, Provenance, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.run_lengths import encode_rle, mask_bbox

CROP_MARGIN_PX = 8
CROP_MAX_PX = 256  # a wall's crop is the whole image; a person needs no more than this to recognise a thing
CROP_JPEG_QUALITY = 85


class MaskRefused(ValueError):
    """A mask gives no observation; the message is the reason, the same for all of its kind."""


@dataclass(frozen=True)
class Refusal:
    """A mask that gave no observation, and why."""

    frame: int
    mask: int
    reason: str


def acquire(frame: RgbdFrame, masks: Sequence[Mask], parameters: Parameters) -> tuple[list[Observation], list[Refusal]]:
    """The observations o_e of one frame (eq. observation), and the masks that were refused."""
    observations: list[Observation] = []
    refusals: list[Refusal] = []
    for mask in masks:
        try:
            observations.append(observe(frame, mask, parameters))
        except MaskRefused as refused:
            refusals.append(Refusal(frame.index, mask.index, str(refused)))
    return observations, refusals


def observe(frame: RgbdFrame, mask: Mask, parameters: Parameters) -> Observation:
    """One mask as an observation; raises MaskRefused.

    n_e is the number of occupied voxels: w_e = c sqrt(n) must not follow the image's resolution.
    """
    pixels = np.asarray(mask.pixels, dtype=bool)
    if pixels.shape != frame.depth_m.shape:
        raise MaskRefused("mask has another size than the frame")
    if np.count_nonzero(pixels) < parameters.min_mask_px:
        raise MaskRefused(f"mask smaller than {parameters.min_mask_px} pixels")
    if not pixels.any():
        raise MaskRefused("mask has no pixel")
    bbox = mask_bbox(pixels)
    points = backproject(pixels, frame, parameters, bbox)
    if len(points) < parameters.min_points:
        raise MaskRefused(_out_of_range(pixels, frame, parameters))
    try:
        points = largest_cluster(points, parameters)
    except ValueError as too_fine:
        raise MaskRefused(str(too_fine)) from too_fine
    if len(points) == 0:
        raise MaskRefused("its points are too sparse to cluster")
    return Observation(
        frame=frame.index,
        mask=mask.index,
        phrase=mask.phrase or None,
        confidence=mask.confidence,
        points=points,
        feature=mask.feature,
        provenance=provenance(frame, pixels, bbox),
    )


def _out_of_range(pixels: Array, frame: RgbdFrame, parameters: Parameters) -> str:
    """Too little depth in range, and where most of what was measured lies, in whole metres: one reason for its kind."""
    reason = f"fewer than {parameters.min_points} pixels with depth in range"
    depth_m = frame.depth_m[pixels]
    measured = depth_m[np.isfinite(depth_m) & (depth_m > 0)]
    if len(measured) < parameters.min_points:
        return reason
    at_m = float(np.median(measured))
    if at_m > parameters.depth_max_m:
        return f"{reason}: it is {at_m:.0f} m away, and depth_max_m is {parameters.depth_max_m:g} m"
    return f"{reason}: it is {at_m:.2g} m away, and depth_min_m is {parameters.depth_min_m:g} m"


def provenance(frame: RgbdFrame, pixels: Array, bbox: tuple[int, int, int, int]) -> Provenance:
    """Where the mask was and what it looked like, so that a person can be shown it. bbox: around its pixels."""
    return Provenance(frame.recording, frame.stamp_ns, bbox, encode_rle(pixels, bbox), crop_jpeg(frame.color, bbox))


def crop_jpeg(color: Array, bbox: tuple[int, int, int, int]) -> bytes:
    """The box and a margin of (h, w, 3) RGB as JPEG, at most CROP_MAX_PX on its longer side."""
    x0, y0, x1, y1 = bbox
    m = CROP_MARGIN_PX
    crop = color[max(y0 - m, 0) : y1 + m, max(x0 - m, 0) : x1 + m]
    shrink = CROP_MAX_PX / max(crop.shape[:2])
    if shrink < 1:
        crop = cv2.resize(crop, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
    bgr = cv2.cvtColor(np.ascontiguousarray(crop), cv2.COLOR_RGB2BGR)
    return cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, CROP_JPEG_QUALITY])[1].tobytes()
