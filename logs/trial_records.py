"""What a trial holds, record by record: the inputs that a mission consumed, its decisions, and notes beside them.

A record's topic names it in the file. Inputs are read back in order by a replay, decisions are compared with the
replay's, notes are for people only. Decisions carry no wall-clock time, so that a replay writes the same bytes.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from typing import ClassVar, Literal, TypeAlias

import numpy as np
from pydantic import BaseModel, ConfigDict

from drivers.ports import CameraFrame
from openbelief.arrays import Array
from openbelief.observation import Intrinsics, Mask, decode_rle, encode_rle
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid

Role: TypeAlias = Literal["input", "decision", "note"]


class Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Record(Part):
    """One line of a trial. Raises pydantic's ValidationError on unknown fields and numbers that are not finite."""

    topic: ClassVar[str]
    role: ClassVar[Role]


class PlanarPose(Part):
    """A pose in the map frame: metres and radians."""

    x: float
    y: float
    yaw: float

    @classmethod
    def of(cls, pose: Pose2) -> PlanarPose:
        return cls(x=float(pose.x), y=float(pose.y), yaw=float(pose.yaw))

    def pose2(self) -> Pose2:
        return Pose2(self.x, self.y, self.yaw)


class Calibration(Part):
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


class Segment(Part):
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


# ---- inputs, in the order in which a mission consumes them


class Query(Record):
    """What the operator asked for."""

    topic: ClassVar[str] = "/trial/query"
    role: ClassVar[Role] = "input"
    sentence: str


class NavigatorState(Record):
    """`Navigator.unavailable`: None where a goal could be taken."""

    topic: ClassVar[str] = "/trial/navigator"
    role: ClassVar[Role] = "input"
    unavailable: str | None


class RobotPose(Record):
    """Where the robot was."""

    topic: ClassVar[str] = "/trial/robot_pose"
    role: ClassVar[Role] = "input"
    pose: PlanarPose


class Transform(Record):
    """T_map_frame at a stamp, row by row."""

    topic: ClassVar[str] = "/trial/transform"
    role: ClassVar[Role] = "input"
    stamp_ns: int
    frame_id: str
    T_map_frame: tuple[float, ...]

    @classmethod
    def of(cls, stamp_ns: int, frame_id: str, T: Array) -> Transform:
        return cls(stamp_ns=stamp_ns, frame_id=frame_id, T_map_frame=tuple(float(v) for v in np.ravel(T)))

    def matrix(self) -> Array:
        return np.array(self.T_map_frame, dtype=np.float64).reshape(4, 4)


class MapUsed(Record):
    """The grid that goal poses were searched on. Cells are on /trial/map/grid, heights on /trial/map/heights (32FC1).

    sha256: over both; the grid is in the file once, before the first record that names it.
    """

    topic: ClassVar[str] = "/trial/map"
    role: ClassVar[Role] = "input"
    stamp_ns: int
    resolution_m: float
    origin_xy: tuple[float, float]
    shape: tuple[int, int]
    has_heights: bool
    sha256: str

    @classmethod
    def of(cls, grid: OccupancyGrid) -> MapUsed:
        heights = b"" if grid.heights_m is None else np.asarray(grid.heights_m, dtype="<f4").tobytes()
        height, width = grid.cells.shape
        return cls(
            stamp_ns=int(grid.stamp_ns),
            resolution_m=float(grid.resolution_m),
            origin_xy=(float(grid.origin_xy[0]), float(grid.origin_xy[1])),
            shape=(height, width),
            has_heights=grid.heights_m is not None,
            sha256=hashlib.sha256(grid.cells.astype(np.int8).tobytes() + heights).hexdigest(),
        )


class Frame(Record):
    """A camera frame; its images are on /trial/frame/color (rgb8) and /trial/frame/depth (32FC1), lossless."""

    topic: ClassVar[str] = "/trial/frame"
    role: ClassVar[Role] = "input"
    stamp_ns: int
    frame_id: str
    intrinsics: Calibration

    @classmethod
    def of(cls, frame: CameraFrame) -> Frame:
        calibration = Calibration.of(frame.intrinsics)
        return cls(stamp_ns=int(frame.stamp_ns), frame_id=frame.frame_id, intrinsics=calibration)


class Segments(Record):
    """What perception saw in the frame of that stamp."""

    topic: ClassVar[str] = "/trial/masks"
    role: ClassVar[Role] = "input"
    stamp_ns: int
    perception: str
    feature_text_aligned: bool
    masks: tuple[Segment, ...]

    @classmethod
    def of(cls, stamp_ns: int, perception: str, masks: Sequence[Mask], *, feature_text_aligned: bool) -> Segments:
        return cls(
            stamp_ns=stamp_ns,
            perception=perception,
            feature_text_aligned=feature_text_aligned,
            masks=tuple(Segment.of(mask) for mask in masks),
        )


class Plan(Record):
    """The planner's answer to "could you get there?"."""

    topic: ClassVar[str] = "/trial/plan"
    role: ClassVar[Role] = "input"
    goal: PlanarPose
    length_m: float | None
    reason: str


class OperatorReply(Record):
    """What the operator answered to "may I?": yes, no, expired or stop."""

    topic: ClassVar[str] = "/trial/operator_reply"
    role: ClassVar[Role] = "input"
    question: str
    reply: str


class GoalAnswer(Record):
    """How the navigator took a goal. status None: accepted and under way."""

    topic: ClassVar[str] = "/trial/goal_answer"
    role: ClassVar[Role] = "input"
    goal: PlanarPose
    status: str | None
    reason: str
    code: int


class NavigationEnd(Record):
    """How a goal under way ended."""

    topic: ClassVar[str] = "/trial/navigation_result"
    role: ClassVar[Role] = "input"
    status: str
    reason: str
    code: int


class CancelAnswer(Record):
    """How the navigator took a cancel."""

    topic: ClassVar[str] = "/trial/cancel"
    role: ClassVar[Role] = "input"
    because: str
    status: str
    reason: str
    code: int


class Stop(Record):
    """The operator's STOP. polls: how often it was asked for since the last input before it came."""

    topic: ClassVar[str] = "/trial/stop"
    role: ClassVar[Role] = "input"
    because: str
    polls: int


class PortFailure(Record):
    """A port that raised instead of answering; that is an input as well."""

    topic: ClassVar[str] = "/trial/port_error"
    role: ClassVar[Role] = "input"
    call: str
    kind: str
    message: str
    polls: int


# ---- decisions


class Scored(Part):
    object_id: int
    score: float
    visual: float | None
    language: float | None
    label: str | None


class Ranking(Record):
    """retrieve(q, R_q): the best remaining candidates, best first; empty is the paper's NONE."""

    topic: ClassVar[str] = "/trial/ranking"
    role: ClassVar[Role] = "decision"
    target: str
    readout: str
    rejected: tuple[int, ...]
    set_aside: tuple[int, ...]
    candidates: tuple[Scored, ...]


class Chosen(Record):
    """The candidate i of attempt k."""

    topic: ClassVar[str] = "/trial/candidate"
    role: ClassVar[Role] = "decision"
    attempt: int
    object_id: int
    label: str
    score: float


class Goal(Record):
    """A goal pose, or the reason why there is none. path_length_m is the planner's."""

    topic: ClassVar[str] = "/trial/goal"
    role: ClassVar[Role] = "decision"
    object_id: int
    purpose: Literal["approach", "re-observe"]
    pose: PlanarPose | None
    expected_visibility: float | None
    path_length_m: float | None
    reason: str


class Check(Part):
    """One arrival check: its value against its threshold; None where there was nothing to measure."""

    value: float | None
    threshold: float


class Checks(Record):
    """The three ordered checks at a candidate, and the verdict."""

    topic: ClassVar[str] = "/trial/checks"
    role: ClassVar[Role] = "decision"
    object_id: int
    frame_stamp_ns: int
    visibility: Check
    semantic: Check
    geometric: Check
    expected: int
    occluded: float
    out_of_view: float
    no_depth: float
    see_through: float
    pose_error_m: float
    mask_index: int | None
    verdict: str
    reason: str


class Exclusion(Record):
    """A candidate that retrieval leaves out from now on: rejected is evidence, set aside is not."""

    topic: ClassVar[str] = "/trial/exclusion"
    role: ClassVar[Role] = "decision"
    object_id: int
    where: Literal["rejected", "set aside"]
    because: str


class Transition(Record):
    """A state left for another by an event, and why."""

    topic: ClassVar[str] = "/trial/transition"
    role: ClassVar[Role] = "decision"
    source: str
    event: str
    target: str
    because: str


class Ended(Record):
    """How the mission ended."""

    topic: ClassVar[str] = "/trial/outcome"
    role: ClassVar[Role] = "decision"
    end: str
    reason: str
    visits: int
    object_id: int | None
    rejected: tuple[int, ...]
    set_aside: tuple[int, ...]


# ---- notes


class Feedback(Record):
    """What the navigator said on the way."""

    topic: ClassVar[str] = "/trial/feedback"
    role: ClassVar[Role] = "note"
    stamp_ns: int
    pose: PlanarPose
    distance_remaining_m: float
    navigation_time_s: float
    recoveries: int


class Told(Record):
    """A sentence shown to the operator."""

    topic: ClassVar[str] = "/trial/told"
    role: ClassVar[Role] = "note"
    sentence: str


RECORDS: dict[str, type[Record]] = {kind.topic: kind for kind in Record.__subclasses__()}
