"""What the records of a trial are made of, and our own types to and from it."""

from __future__ import annotations

import base64
from typing import ClassVar, Literal, TypeAlias

import numpy as np
from pydantic import BaseModel, ConfigDict

from openbelief.observation import Intrinsics, Mask
from openbelief.pose import Pose2
from openbelief.run_lengths import decode_rle, encode_rle

Role: TypeAlias = Literal["input", "decision", "note"]


class RecordPart(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Record(RecordPart):
    """One line of a trial. Raises pydantic's ValidationError on unknown fields and numbers that are not finite."""

    topic: ClassVar[str]
    role: ClassVar[Role]


class Input(Record):
    """What a mission consumed; a replay gives it out again."""

    role: ClassVar[Role] = "input"


class Decision(Record):
    """What a mission concluded; a replay must conclude the same. It carries no wall-clock time."""

    role: ClassVar[Role] = "decision"


class Note(Record):
    """For people only; a replay does not look at it."""

    role: ClassVar[Role] = "note"


class PlanarPose(RecordPart):
    """A pose in the map frame: metres and radians."""

    x: float
    y: float
    yaw: float

    @classmethod
    def of(cls, pose: Pose2) -> PlanarPose:
        return cls(x=float(pose.x), y=float(pose.y), yaw=float(pose.yaw))

    def pose2(self) -> Pose2:
        return Pose2(self.x, self.y, self.yaw)


class Calibration(RecordPart):
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...]

    @classmethod
    def of(cls, k: Intrinsics) -> Calibration:
        distortion = tuple(float(c) for c in k.distortion)
        return cls(
            width=int(k.width),
            height=int(k.height),
            fx=float(k.fx),
            fy=float(k.fy),
            cx=float(k.cx),
            cy=float(k.cy),
            distortion=distortion,
        )

    def intrinsics(self) -> Intrinsics:
        return Intrinsics(self.width, self.height, self.fx, self.fy, self.cx, self.cy, self.distortion)


class Segment(RecordPart):
    """One mask of perception. feature: base64 of little-endian float32."""

    index: int
    phrase: str | None
    confidence: float
    rle_size: tuple[int, int]
    rle_counts: tuple[int, ...]
    feature: str

    @classmethod
    def of(cls, mask: Mask) -> Segment:
        rle = encode_rle(mask.pixels)
        return cls(
            index=int(mask.index),
            phrase=mask.phrase,
            confidence=float(mask.confidence),
            rle_size=(rle["size"][0], rle["size"][1]),
            rle_counts=tuple(rle["counts"]),
            feature=base64.b64encode(np.asarray(mask.feature, dtype="<f4").tobytes()).decode(),
        )

    def mask(self) -> Mask:
        pixels = decode_rle({"size": list(self.rle_size), "counts": list(self.rle_counts)})
        feature = np.frombuffer(base64.b64decode(self.feature), dtype="<f4").astype(np.float32)
        return Mask(self.index, pixels, self.phrase, self.confidence, feature)
