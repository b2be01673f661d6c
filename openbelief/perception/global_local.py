"""The object feature f_e^v: a mask's own look, with a little of the frame that it was seen in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from openbelief.arrays import Array, normalize
from openbelief.observation import RgbdFrame
from openbelief.perception.ports import ImageEncoder, SegmentedMask
from openbelief.run_lengths import mask_bbox

MASKED_SHARE = 0.4418  # HOV-SG; the rest is the box crop's
BOX_MARGIN_PX = 50
# With few masks in a frame the published softmax lets the whole image replace the object (one mask gives w = 1).
GLOBAL_MAX = 0.1


class GlobalLocalFeatures:
    """SegmentEncoder over an ImageEncoder; the frame and all crops go through it in one batch."""

    def __init__(self, encoder: ImageEncoder) -> None:
        self._encoder = encoder

    @property
    def id(self) -> str:
        return f"global-local({self._encoder.id})"

    @property
    def dim(self) -> int:
        return self._encoder.dim

    @property
    def text_space(self) -> str | None:
        return self._encoder.text_space

    def encode(self, frame: RgbdFrame, segments: Sequence[SegmentedMask]) -> Array:
        """(m, dim) float32 unit rows."""
        if not segments:
            return np.zeros((0, self.dim), dtype=np.float32)
        pairs = [crops(frame.color, segment.pixels) for segment in segments]
        pictures = [frame.color, *(masked for masked, _ in pairs), *(box for _, box in pairs)]
        rows = self._encoder.encode(pictures).astype(np.float64)
        m = len(segments)
        return combine(rows[0], rows[1 : 1 + m], rows[1 + m :]).astype(np.float32)


def crops(color: Array, pixels: Array) -> tuple[Array, Array]:
    """The mask's box with its margin, without what is not the mask (black), and as it is."""
    x0, y0, x1, y1 = mask_bbox(pixels)
    window = np.s_[max(y0 - BOX_MARGIN_PX, 0) : y1 + BOX_MARGIN_PX, max(x0 - BOX_MARGIN_PX, 0) : x1 + BOX_MARGIN_PX]
    return np.where(pixels[window][..., None], color[window], np.uint8(0)), color[window]


def combine(whole: Array, masked: Array, boxes: Array) -> Array:
    """F = norm(w F_g + (1 - w) F_l), F_l = norm(0.4418 masked + 0.5582 box), w = softmax of cos(F_l, F_g), at most 0.1.

    whole F_g: (d,); masked, boxes: (m, d); all unit length. Returns (m, d) unit rows.
    """
    local = normalize(MASKED_SHARE * masked + (1 - MASKED_SHARE) * boxes)
    cosines = local @ whole
    shares = np.exp(cosines - cosines.max())
    w = np.minimum(shares / shares.sum(), GLOBAL_MAX)[:, None]
    return normalize(w * whole + (1 - w) * local)
