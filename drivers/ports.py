"""The ports: every piece of hardware is one of these Protocols with a real, a replayed and a simulated body.

Values that cross a port are immutable. Absence is an exception that names its cause, never a default value.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, runtime_checkable

from openbelief.arrays import Array
from openbelief.observation import Intrinsics
from openbelief.perception.ports import Perception
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid

ANY_AGE_S = 1e8  # three years: the max_age_s of a reader that takes any age, and judges by what changes


class PortError(RuntimeError):
    """A port cannot answer; the message is a sentence for the operator."""


class StaleData(PortError):
    """The newest data is older than was asked for, or there is none yet."""


class PoseUnavailable(PortError):
    """No transform chain covers that stamp; it is never extrapolated or guessed."""


class LinkLost(PortError):
    """The other end went away (bridge, robot, sensor)."""


class Interrupted(PortError):
    """The operator's STOP came before the answer, which is not waited for."""


@dataclass(frozen=True)
class CameraFrame:
    """One RGB-D image without a pose. color: (h, w, 3) uint8 RGB. depth_m: (h, w) float32, 0 = no measurement."""

    stamp_ns: int
    color: Array
    depth_m: Array
    intrinsics: Intrinsics
    frame_id: str


@dataclass(frozen=True)
class LidarCloud:
    """points: (n, 3) float32 in `frame_id`, metres; no-returns already removed."""

    stamp_ns: int
    points: Array
    frame_id: str


@dataclass(frozen=True, slots=True)
class StampedPose:
    """T_map_base_link, planar, and when it was so."""

    stamp_ns: int
    pose: Pose2


@dataclass(frozen=True, slots=True)
class BatteryState:
    """The battery's state: `fraction` 0 to 1."""

    stamp_ns: int
    fraction: float


class Reaction(StrEnum):
    """What a supervisor's verdict asks for, from the mildest to the gravest."""

    GO = "go"
    NO_NEW_MOTION = "no new motion"  # what is under way goes on
    HOLD = "hold"  # the goal is cancelled; it may be taken up again once the condition is over
    CANCEL = "cancel"  # the goal is cancelled and the mission ends


@dataclass(frozen=True, slots=True)
class SafetyVerdict:
    """A supervisor's word. condition: its row of the table, "" with GO. sentence: for the operator."""

    reaction: Reaction = Reaction.GO
    condition: str = ""
    sentence: str = ""


class NavigationStatus(StrEnum):
    """How a navigation goal ended, as the navigator says. Whether the robot stands there is checked by its pose."""

    SUCCEEDED = "succeeded"  # by its result message; a status alone is not enough
    ABORTED = "aborted"  # Nav2 gave up: code and message say why
    REJECTED = "rejected"  # the server did not take the goal
    CANCELED = "canceled"  # we, or somebody else, cancelled it
    TIMED_OUT = "timed out"  # our own limit; the goal was cancelled and the cancel was acknowledged
    PREEMPTED = "preempted"  # another goal replaced ours
    LOST = "lost"  # link, server or localisation gone: the robot's state is unknown
    STILL_MOVING = "still moving"  # a cancel went unanswered: the operator must use the remote


@dataclass(frozen=True, slots=True)
class NavigationResult:
    """The end of one goal. `reason` is a sentence for the operator; `code` is Nav2's error_code, 0 = none."""

    status: NavigationStatus
    reason: str
    code: int = 0


@dataclass(frozen=True, slots=True)
class NavigationFeedback:
    """What Nav2 says on the way."""

    stamp_ns: int
    pose: Pose2
    distance_remaining_m: float
    navigation_time_s: float
    recoveries: int


@dataclass(frozen=True, slots=True)
class PathPlan:
    """The answer to "could you get there?": a length where there is a path, else None and the reason.

    path_prefix: (x, y) points of its first metres, map frame, where the planner tells them. path: all of it, thinned.
    """

    length_m: float | None
    reason: str = ""
    path_prefix: tuple[tuple[float, float], ...] = ()
    path: tuple[tuple[float, float], ...] = ()


class Approval(StrEnum):
    """A person's answers to "may I?"."""

    YES = "yes"
    NO = "no"
    NOT_THIS_ONE = "not this one"  # a candidate is set aside as declined; the search goes on
    TAKE = "take"  # another candidate first
    EXPIRED = "expired"
    STOP = "stop"


@dataclass(frozen=True, slots=True)
class Option:
    """A candidate that a person may take, or set aside, by its number: from 1, best first."""

    number: int
    object_id: int
    label: str
    score: float


@dataclass(frozen=True, slots=True)
class Question:
    """ "May I walk there?", bound to what was meant: object, goal pose (map frame), path length, memory.

    because: why this object, for who asks "why". options: the ranked candidates, this one among them; () where only yes
    and no make sense. doubt: why it may not be what was asked for, and then only a person may say yes; else "".
    """

    sentence: str
    memory_hash: str = ""
    object_id: int | None = None
    goal: Pose2 | None = None
    path_length_m: float | None = None
    because: str = ""
    options: tuple[Option, ...] = ()
    doubt: str = ""


@dataclass(frozen=True, slots=True)
class Reply:
    """object_id: with NOT_THIS_ONE and TAKE, which. who, how: the person, the client. at_ns: of the epoch."""

    word: Approval
    object_id: int | None = None
    who: str = ""
    how: str = ""
    at_ns: int = 0


@dataclass(frozen=True, slots=True)
class StopRequest:
    """A person's STOP, or what stands for one. who, how, at_ns: as in Reply."""

    because: str
    who: str = ""
    how: str = ""
    at_ns: int = 0


@runtime_checkable
class Clock(Protocol):
    """The only reader of time."""

    def now_ns(self) -> int:
        """Nanoseconds since the epoch."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let that much of this clock's time pass (a simulated clock moves the world meanwhile)."""
        ...


@runtime_checkable
class Camera(Protocol):
    def latest(self, max_age_s: float) -> CameraFrame:
        """The newest frame; raises StaleData where it is older than `max_age_s` by this port's clock."""
        ...


@runtime_checkable
class Lidar(Protocol):
    def latest(self, max_age_s: float) -> LidarCloud:
        """The newest cloud; raises StaleData as Camera does."""
        ...


@runtime_checkable
class Battery(Protocol):
    def latest(self, max_age_s: float) -> BatteryState:
        """The newest charge; raises StaleData as Camera does."""
        ...


@runtime_checkable
class Safety(Protocol):
    """Asked before motion and at every poll of a drive. Never raises for missing data: that is a verdict."""

    def verdict(self, goal: Pose2 | None) -> SafetyVerdict:
        """goal: where the robot goes or is about to go; None before a mission begins."""
        ...


@runtime_checkable
class PoseSource(Protocol):
    def transform_at(self, stamp_ns: int, frame_id: str) -> Array:
        """(4, 4) T_map_frame at that stamp, interpolated between samples; raises PoseUnavailable."""
        ...

    def robot_pose(self, max_age_s: float) -> Pose2:
        """T_map_base_link now, planar; raises StaleData where it is older than `max_age_s`."""
        ...

    def stamped_pose(self, max_age_s: float) -> StampedPose:
        """The same with its stamp, so that a pose read twice is not taken for two measurements."""
        ...


@runtime_checkable
class Map(Protocol):
    def latest(self) -> OccupancyGrid:
        """The navigation map; raises StaleData where none has arrived."""
        ...


@runtime_checkable
class Navigator(Protocol):
    """One goal at a time. Nothing here blocks for longer than a network time-out; `result` is polled."""

    def unavailable(self) -> str | None:
        """None when a goal can be taken, else why not (Nav2 not active, no link, stale pose ...)."""
        ...

    def plan(self, goal: Pose2) -> PathPlan:
        """Reachability and path length from where the robot is, without moving."""
        ...

    def send(self, goal: Pose2) -> NavigationResult | None:
        """Send a goal. None: accepted and under way. A result: it ended at once (rejected, lost ...)."""
        ...

    def feedback(self) -> NavigationFeedback | None:
        """The newest feedback of the goal under way, None before the first."""
        ...

    def result(self) -> NavigationResult | None:
        """None while the goal is under way; afterwards how it ended (asked again: the same)."""
        ...

    def cancel(self, *, because: str) -> NavigationResult:
        """Cancel the goal under way and wait for the acknowledgement, 1 s at most.

        CANCELED when acknowledged (or when it had ended: then that end). STILL_MOVING when unanswered, after
        cancel-all was tried too.
        """
        ...

    def halt(self, *, because: str) -> NavigationResult:
        """Cancel every goal of the robot, ours or not, whatever is believed of them; 1 s at most.

        CANCELED when every server acknowledged, else STILL_MOVING.
        """
        ...


@runtime_checkable
class Operator(Protocol):
    """The person in charge."""

    def confirm(self, question: Question, timeout_s: float) -> Reply:
        """Ask for a yes before motion; without an answer in time EXPIRED, with a STOP at any time STOP."""
        ...

    def stop_requested(self) -> StopRequest | None:
        """A STOP since this mission began, else None. Never blocks."""
        ...

    def tell(self, sentence: str) -> None:
        """Show one sentence."""
        ...


@dataclass(frozen=True)
class Ports:
    """One body behind each port that a mission reads or drives.

    lidar None: goals are not checked against a cloud. safety None: nobody supervises.
    """

    clock: Clock
    camera: Camera
    poses: PoseSource
    map: Map
    navigator: Navigator
    operator: Operator
    perception: Perception
    lidar: Lidar | None = None
    safety: Safety | None = None
