"""The one table of why a colour image gives no frame, and what a person can do about each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from drivers.ports import PoseUnavailable
from drivers.ros.refusals import ImageReason
from drivers.ros.transform_edge import (
    TransformDisputed,
    TransformInvalid,
    TransformMissing,
    TransformNotYet,
    TransformStale,
    TransformTooOld,
)


class RecordingError(ValueError):
    """The recording as a whole cannot give frames; one line with the cause and the remedy."""


class FrameReason(StrEnum):
    """What is missing or wrong around an image; what is wrong in it says `ImageReason`."""

    NO_TRANSFORM = "no transform to the map"
    NOT_COVERED = "no transform at its stamp"
    GAP = "stale transform"
    NOT_RIGID = "invalid transform"
    DISPUTED = "two publishers of one transform"
    NO_DEPTH = "no depth image at its stamp"
    NOT_ALIGNED = "depth not aligned to colour"
    REPEATED = "repeated stamp"
    NO_PARTNER = "its pictures could not be read again"


# fmt: off
REMEDIES: dict[FrameReason | ImageReason, str] = {
    FrameReason.NO_TRANSFORM: "say --map-frame FRAME where the map's frame has another name, record /tf and /tf_static "
                              "too, and name all files of a split recording in one command",
    FrameReason.NOT_COVERED:  "localisation has to run before the first image and until after the last one",
    FrameReason.GAP:          "where the localisation is slow, allow larger gaps with --max-tf-gap-s SECONDS",
    FrameReason.NOT_RIGID:    "the publisher of that transform sends NaN, no rotation, or two parents of one frame",
    FrameReason.DISPUTED:     "stop one of the two nodes and record again",
    FrameReason.NO_DEPTH:     "allow more with --pair-tolerance-s SECONDS, or shift the depth camera's clock with "
                              "--depth-offset-s SECONDS",
    FrameReason.NOT_ALIGNED:  "record depth aligned to colour; --depth-is-aligned where only its frame_id is wrong",
    FrameReason.REPEATED:     "the same stamp came before: was the recording played twice?",
    FrameReason.NO_PARTNER:   "the file changed while it was read: map it again",
    ImageReason.COLOR_ENCODING: "record one of the known encodings, or convert it with image_transport republish",
    ImageReason.DEPTH_ENCODING: "depth has to be 16UC1, 32FC1, or compressedDepth (PNG or RVL): record it so",
    ImageReason.MALFORMED:    "the camera's driver or the recorder cut the image; others are used",
    ImageReason.SIZES:        "record colour, depth aligned to it and the camera info of that very size",
    ImageReason.NO_CALIBRATION: "calibrate the camera, or record its camera_info once it has loaded its calibration",
    ImageReason.DISTORTION:   "record the rectified image (image_proc) with its camera_info",
    ImageReason.RECTIFICATION: "record the raw image with its camera_info, or the rectified one of the left camera",
}
TRANSFORM_REASONS: dict[type[PoseUnavailable], FrameReason] = {
    TransformMissing:  FrameReason.NO_TRANSFORM,
    TransformNotYet:   FrameReason.NOT_COVERED,
    TransformTooOld:   FrameReason.NOT_COVERED,
    TransformStale:    FrameReason.GAP,
    TransformInvalid:  FrameReason.NOT_RIGID,
    TransformDisputed: FrameReason.DISPUTED,
}
# fmt: on


@dataclass(frozen=True)
class Skip:
    """A colour image that gives no frame. reason: the same for all of its kind; detail: this one's."""

    index: int
    stamp_ns: int
    reason: FrameReason | ImageReason
    detail: str


class SkipFrame(Exception):
    """This frame is not used; `reason` and `detail` say why."""

    def __init__(self, reason: FrameReason | ImageReason, detail: str) -> None:
        super().__init__(detail)
        self.reason, self.detail = reason, detail


def explained(skips: Iterable[Skip]) -> str:
    """All that is known of them: how many of each reason, the first one's detail, what to do."""
    first: dict[str, Skip] = {}
    counts: Counter[str] = Counter()
    for skip in skips:
        first.setdefault(skip.reason, skip)
        counts[skip.reason] += 1
    return "; ".join(
        f"{count} x {reason} (image {first[reason].index}: {first[reason].detail}) - {REMEDIES[first[reason].reason]}"
        for reason, count in counts.most_common()
    )
