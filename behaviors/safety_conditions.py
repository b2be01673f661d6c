"""When the robot may not move: one row a condition, with what it asks for and the operator's sentence."""

from __future__ import annotations

from collections.abc import Callable

from behaviors.safety_facts import Known
from behaviors.safety_policy import SafetyPolicy
from drivers.ports import Reaction
from openbelief.polygon import inside
from openbelief.pose import Pose2

Condition = Callable[[Known], str | None]


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
