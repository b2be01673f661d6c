"""May the robot move? A pure judgement over what is known now, condition by condition.

Time is monotonic and belongs to us: a sample is as old as the moment at which it last *changed* here. So data that is
missing, a stamp that stands still and the same picture under new stamps are all caught, and a clock that jumps by an
hour, ours or the robot's, changes nothing.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass as settings

from drivers.ports import Reaction, SafetyVerdict
from openbelief.polygon import inside
from openbelief.pose import Pose2, wrap_angle
from openbelief.settings import CHECKED, Number, Positive, Whole, in_one_line

SPEED_MAX, TURN_MAX = 1.5, 2.0  # m/s and rad/s: no G1 under Nav2 is faster
JUMP_WINDOW_NS = 1_000_000_000  # a pose is compared with those of so long before, and with the last one before a gap
Corners = tuple[tuple[Number, Number], ...]


@in_one_line("Safety limit")
@settings(frozen=True, kw_only=True, config=CHECKED)
class SafetyPolicy:
    """What is configured about safety. watchdog: whether a robot over ROS must have one; lidar: whether it is used.

    keep_out: polygons nothing may enter; allowed: one polygon nothing may leave, () = everywhere; points
    are (x, y), map frame, metres. Raises ValueError on limits that make no sense.
    """

    watchdog: Literal["required", "off"] = "required"
    lidar: Literal["used", "off"] = "used"
    pose_max_age_s: Positive = 0.5
    cloud_max_age_s: Positive = 1.0
    camera_max_age_s: Positive = 2.0
    stuck_s: Positive = 3.0  # the same pixels or points under new stamps for so long
    jump_m: Positive = 0.5
    jump_rad: Positive = 1.0
    battery_start: Positive = 0.40
    battery_return: Positive = 0.25
    disk_min_bytes: Annotated[Whole, Field(ge=0)] = 2_000_000_000
    keep_out: tuple[Corners, ...] = ()
    allowed: Corners = ()

    @model_validator(mode="after")
    def _make_sense(self) -> SafetyPolicy:
        for name in ("battery_start", "battery_return"):
            if getattr(self, name) > 1:
                raise ValueError(f"Safety limit {name} is a share of 1, not a percentage: got {getattr(self, name)}.")
        if self.battery_start < self.battery_return:
            raise ValueError(
                f"Safety limit battery_start ({self.battery_start:g}) must not be less than battery_return "
                f"({self.battery_return:g}): a mission would be called back at once."
            )
        for polygon in (*self.keep_out, *([self.allowed] if self.allowed else [])):
            if len(polygon) < 3:
                raise ValueError(f"A keep-out or allowed polygon needs 3 or more finite (x, y) points, got {polygon}.")
        return self


@dataclass(frozen=True, slots=True)
class Sample:
    """What a sensor's newest sample is known by. digest: of its content."""

    stamp_ns: int
    digest: int


@dataclass(frozen=True, kw_only=True)
class SafetyFacts:
    """What is known now. A sensor that is not there at all is not in `expected`; None: expected and no data.

    pose: fresh (its own age is the port's). battery: 0 to 1. goal: where it goes or is about to go, None before a
    mission. link, watchdog, memory: sentences on what is wrong there, None where nothing is.
    """

    expected: frozenset[str] = frozenset()  # of "camera", "cloud", "battery"
    pose: Pose2 | None = None
    camera: Sample | None = None
    cloud: Sample | None = None
    battery: float | None = None
    disk_free_bytes: int | None = None
    goal: Pose2 | None = None
    link: str | None = None
    watchdog: str | None = None
    memory: str | None = None


@dataclass
class Ages:
    """When a sensor's stamp and its content last changed, by our time; None before its first sample."""

    sample: Sample | None = None
    stamp_changed_ns: int | None = None
    content_changed_ns: int | None = None

    def see(self, now_ns: int, sample: Sample | None) -> None:
        if sample is None:
            return
        if self.sample is None or sample.stamp_ns != self.sample.stamp_ns:
            self.stamp_changed_ns = now_ns
        if self.sample is None or sample.digest != self.sample.digest:
            self.content_changed_ns = now_ns
        self.sample = sample

    def trouble(self, now_ns: int, what: str, max_age_s: float, stuck_s: float) -> str | None:
        if self.stamp_changed_ns is None or self.content_changed_ns is None:
            return f"There is no {what} yet."
        if (age_s := (now_ns - self.stamp_changed_ns) / 1e9) > max_age_s:
            return f"No new {what} for {age_s:.1f} s (allowed: {max_age_s:g} s)."
        if (same_s := (now_ns - self.content_changed_ns) / 1e9) > stuck_s:
            return f"The {what} is stuck: its content has been the same for {same_s:.1f} s."
        return None


@dataclass
class Known:
    """One moment, with what was seen before it."""

    now_ns: int
    facts: SafetyFacts
    limits: SafetyPolicy
    camera: Ages = field(default_factory=Ages)
    cloud: Ages = field(default_factory=Ages)
    jump: str | None = None


Condition = Callable[[Known], str | None]


class Supervisor:
    """`update` gives the gravest verdict, by the order of CONDITIONS among equals."""

    def __init__(self, limits: SafetyPolicy) -> None:
        self._limits, self._camera, self._cloud = limits, Ages(), Ages()
        self._track: deque[tuple[int, Pose2]] = deque()

    def update(self, now_ns: int, facts: SafetyFacts) -> SafetyVerdict:
        self._camera.see(now_ns, facts.camera)
        self._cloud.see(now_ns, facts.cloud)
        known = Known(now_ns, facts, self._limits, self._camera, self._cloud, self._jump(now_ns, facts))
        found = [
            SafetyVerdict(reaction, name, sentence)
            for name, (reaction, condition) in CONDITIONS.items()
            if (sentence := condition(known))
        ]
        return max(found, key=lambda verdict: GRAVITY.index(verdict.reaction), default=SafetyVerdict())

    def _jump(self, now_ns: int, facts: SafetyFacts) -> str | None:
        """Further than any robot walks in that time is localisation's doing."""
        if facts.goal is None:
            self._track.clear()  # before a mission it may have been carried anywhere
        if facts.pose is None:
            return None
        while len(self._track) > 1 and now_ns - self._track[0][0] > JUMP_WINDOW_NS:
            self._track.popleft()
        leaps = (self._leap(now_ns - before_ns, before, facts.pose) for before_ns, before in self._track)
        found = next((leap for leap in leaps if leap), None)
        self._track.append((now_ns, facts.pose))
        return found

    def _leap(self, elapsed_ns: int, before: Pose2, now: Pose2) -> str | None:
        """A robot whose pose was not known, or not asked for, for longer than the window was standing meanwhile."""
        elapsed_s, walking_s = elapsed_ns / 1e9, min(elapsed_ns, JUMP_WINDOW_NS) / 1e9
        moved_m, turned_rad = now.distance_to(before), abs(wrap_angle(now.yaw - before.yaw))
        if moved_m > self._limits.jump_m + SPEED_MAX * walking_s:
            return f"Localisation jumped by {moved_m:.1f} m within {elapsed_s:.1f} s."
        if turned_rad > self._limits.jump_rad + TURN_MAX * walking_s:
            return f"Localisation turned by {math.degrees(turned_rad):.0f} degrees within {elapsed_s:.1f} s."
        return None


def _watchdog(known: Known) -> str | None:
    """The robot's watchdog is latched, or is not heard where it is required."""
    return known.facts.watchdog


def _link(known: Known) -> str | None:
    """The link to the robot is down."""
    return known.facts.link


def _jumped(known: Known) -> str | None:
    """The pose moved further than a robot can walk: `jump_m`, `jump_rad`."""
    return known.jump


def _memory(known: Known) -> str | None:
    """Most of the memory's objects lie off the map when a mission begins."""
    return known.facts.memory


def _pose(known: Known) -> str | None:
    """Nobody knows where the robot is: no map -> base_link younger than `pose_max_age_s`."""
    return None if known.facts.pose else "The robot does not know where it is: no fresh map -> base_link."


def _camera(known: Known) -> str | None:
    """No new image for `camera_max_age_s`, or the same one for `stuck_s`."""
    if "camera" not in known.facts.expected:
        return None
    return known.camera.trouble(known.now_ns, "camera image", known.limits.camera_max_age_s, known.limits.stuck_s)


def _cloud(known: Known) -> str | None:
    """No new cloud for `cloud_max_age_s`, or the same one for `stuck_s`."""
    if "cloud" not in known.facts.expected:
        return None
    return known.cloud.trouble(known.now_ns, "lidar cloud", known.limits.cloud_max_age_s, known.limits.stuck_s)


def _battery_unknown(known: Known) -> str | None:
    """A battery is configured and says nothing."""
    unknown = "battery" in known.facts.expected and known.facts.battery is None
    return "The battery's charge is not known." if unknown else None


def _battery_low(known: Known) -> str | None:
    """Below `battery_start` when a mission begins."""
    charge, limits = known.facts.battery, known.limits
    if charge is None or known.facts.goal is not None or charge >= limits.battery_start:
        return None
    return f"The battery is at {charge:.0%}; a mission starts with {limits.battery_start:.0%} or more."


def _battery_empty(known: Known) -> str | None:
    """Below `battery_return` at any time."""
    charge, least = known.facts.battery, known.limits.battery_return
    return f"The battery is at {charge:.0%}: bring the robot back." if charge is not None and charge < least else None


def _disk(known: Known) -> str | None:
    """Less room than `disk_min_bytes` when a mission begins."""
    free, least = known.facts.disk_free_bytes, known.limits.disk_min_bytes
    if free is None or free >= least:
        return None
    return f"The disk has {free / 1e9:.1f} GB left, less than {least / 1e9:.1f}: a trial might not be recorded."


def _outside(pose: Pose2 | None, limits: SafetyPolicy, who: str) -> str | None:
    """Where a pose must not be, with its place."""
    if pose is None:
        return None
    at = f"({pose.x:.1f}, {pose.y:.1f})"
    for number, polygon in enumerate(limits.keep_out, start=1):
        if inside(pose.xy, polygon)[0]:
            return f"{who} {at} is in keep-out area {number}."
    if limits.allowed and not inside(pose.xy, limits.allowed)[0]:
        return f"{who} {at} is outside the allowed region."
    return None


def _robot_zone(known: Known) -> str | None:
    """The robot is in a `keep_out` polygon or outside `allowed`."""
    return _outside(known.facts.pose, known.limits, "The robot")


def _goal_zone(known: Known) -> str | None:
    """The goal is in a `keep_out` polygon or outside `allowed`; the next-best pose is tried."""
    return _outside(known.facts.goal, known.limits, "The goal")


GOAL_ZONE = "goal zone"  # the one condition that another goal mends
OPERATOR_SILENT = "operator page"  # said by who watches the operator's page, not by the table; its holds do not add up
GRAVITY = (Reaction.GO, Reaction.NO_NEW_MOTION, Reaction.HOLD, Reaction.CANCEL)

# condition -> what it asks for, and the test that gives the operator's sentence
CONDITIONS: dict[str, tuple[Reaction, Condition]] = {
    "watchdog": (Reaction.CANCEL, _watchdog),
    "link": (Reaction.CANCEL, _link),
    "localisation jump": (Reaction.CANCEL, _jumped),
    "robot zone": (Reaction.CANCEL, _robot_zone),
    "battery empty": (Reaction.CANCEL, _battery_empty),
    "memory and map": (Reaction.CANCEL, _memory),
    "pose": (Reaction.HOLD, _pose),
    "cloud": (Reaction.HOLD, _cloud),
    GOAL_ZONE: (Reaction.NO_NEW_MOTION, _goal_zone),
    "camera": (Reaction.NO_NEW_MOTION, _camera),
    "battery low": (Reaction.NO_NEW_MOTION, _battery_low),
    "battery unknown": (Reaction.NO_NEW_MOTION, _battery_unknown),
    "disk": (Reaction.NO_NEW_MOTION, _disk),
}
