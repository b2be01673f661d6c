"""The inputs of a mission, in the words of the ports that gave them."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import AliasChoices, Field, field_validator

from drivers.ports import CameraFrame, LidarCloud
from logs.trial.parts import Calibration, Input, PlanarPose, Segment
from openbelief.arrays import Array
from openbelief.observation import Mask
from openbelief.pose import is_rigid
from openbelief.traversability import OccupancyGrid


class Query(Input):
    """What the operator asked for."""

    topic: ClassVar[str] = "/trial/query"
    sentence: str
    who: str = ""
    how: str = ""  # by which client: terminal, console, voice ...
    after: str = ""  # the sentence before, where "it" or "the other one" is of that


class NavigatorState(Input):
    """`Navigator.unavailable`: None where a goal could be taken."""

    topic: ClassVar[str] = "/trial/navigator"
    unavailable: str | None


class RobotPose(Input):
    """Where the robot was."""

    topic: ClassVar[str] = "/trial/robot_pose"
    pose: PlanarPose


class PoseLook(Input):
    """Where the robot was at a stamp: one of the looks that tell whether it stands."""

    topic: ClassVar[str] = "/trial/pose_look"
    stamp_ns: int
    pose: PlanarPose


class Transform(Input):
    """T_map_frame at a stamp, row by row."""

    topic: ClassVar[str] = "/trial/transform"
    stamp_ns: int
    frame_id: str
    T_map_frame: tuple[float, ...]

    @field_validator("T_map_frame")
    @classmethod
    def _rigid(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        if len(values) != 16 or not is_rigid(np.array(values).reshape(4, 4)):
            raise ValueError("it is no rigid transform: a rotation and a translation, finite, row by row")
        return values

    @classmethod
    def of(cls, stamp_ns: int, frame_id: str, T: Array) -> Transform:
        return cls(stamp_ns=stamp_ns, frame_id=frame_id, T_map_frame=tuple(float(v) for v in np.ravel(T)))

    def matrix(self) -> Array:
        return np.array(self.T_map_frame, dtype=np.float64).reshape(4, 4)


class MapUsed(Input):
    """The grid that goal poses were searched on. Cells are on /trial/map/grid, heights on /trial/map/heights (32FC1).

    sha256: over both; the grid is in the file once, before the first record that names it.
    """

    topic: ClassVar[str] = "/trial/map"
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


class Frame(Input):
    """A camera frame; its images are on /trial/frame/color (rgb8) and /trial/frame/depth (32FC1), lossless."""

    topic: ClassVar[str] = "/trial/frame"
    stamp_ns: int
    frame_id: str
    intrinsics: Calibration

    @classmethod
    def of(cls, frame: CameraFrame) -> Frame:
        calibration = Calibration.of(frame.intrinsics)
        return cls(stamp_ns=int(frame.stamp_ns), frame_id=frame.frame_id, intrinsics=calibration)


class Cloud(Input):
    """A lidar cloud; its points are on /trial/cloud/points, lossless."""

    topic: ClassVar[str] = "/trial/cloud"
    stamp_ns: int
    frame_id: str
    count: int

    @classmethod
    def of(cls, cloud: LidarCloud) -> Cloud:
        return cls(stamp_ns=int(cloud.stamp_ns), frame_id=cloud.frame_id, count=len(cloud.points))


class Segments(Input):
    """What perception saw in the frame of that stamp."""

    topic: ClassVar[str] = "/trial/masks"
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


class Plan(Input):
    """The planner's answer to "could you get there?". path_prefix: its first metres; trials of old called it `way`.

    path: all of it, thinned.
    """

    topic: ClassVar[str] = "/trial/plan"
    goal: PlanarPose
    length_m: float | None
    reason: str
    path_prefix: tuple[tuple[float, float], ...] = Field((), validation_alias=AliasChoices("path_prefix", "way"))
    path: tuple[tuple[float, float], ...] = ()


class OperatorReply(Input):
    """What the operator answered to "may I?": yes, no, not this one, take, expired or stop; who, by which client, when.

    object_id: with "not this one" and "take", which. at_ns: of the epoch, 0 where nobody answered.
    """

    topic: ClassVar[str] = "/trial/operator_reply"
    question: str
    reply: str
    object_id: int | None = None
    who: str = ""
    how: str = ""
    at_ns: int = 0


class GoalAnswer(Input):
    """How the navigator took a goal. status None: accepted and under way."""

    topic: ClassVar[str] = "/trial/goal_answer"
    goal: PlanarPose
    status: str | None
    reason: str
    code: int


class NavigationEnd(Input):
    """How a goal under way ended."""

    topic: ClassVar[str] = "/trial/navigation_result"
    status: str
    reason: str
    code: int


class CancelAnswer(Input):
    """How the navigator took a cancel."""

    topic: ClassVar[str] = "/trial/cancel"
    because: str
    status: str
    reason: str
    code: int


class HaltAnswer(Input):
    """How the navigator took the cancel of all goals."""

    topic: ClassVar[str] = "/trial/halt"
    because: str
    status: str
    reason: str


class Stop(Input):
    """The operator's STOP. polls: how often it was asked for since the last input before it came."""

    topic: ClassVar[str] = "/trial/stop"
    because: str
    polls: int
    who: str = ""
    how: str = ""
    at_ns: int = 0


class Supervised(Input):
    """The supervisor's verdict, where it is not the one before (GO at first). polls: as in Stop."""

    topic: ClassVar[str] = "/trial/supervisor"
    reaction: str
    condition: str
    sentence: str
    polls: int


class PortFailure(Input):
    """A port that raised instead of answering; that is an input as well."""

    topic: ClassVar[str] = "/trial/port_error"
    call: str
    kind: str
    message: str
    polls: int
