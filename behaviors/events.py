"""The words of a mission: what can happen, how it can end, and what the operator is told."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from drivers.ports import Approval, NavigationStatus


class Event(StrEnum):
    """What a state reports when it has acted. The names are the machine's."""

    ASKED = "asked"
    CANDIDATE_FOUND = "candidate_found"
    UNSEEN = "unseen"  # no pose can see the candidate
    NOT_FOUND = "not_found"  # nothing on the map is surely what was asked for, and nobody insisted
    EXHAUSTED = "exhausted"  # retrieve is NONE (or three were set aside), and a candidate was verified
    NONE_VERIFIED = "none_verified"  # the same, and no candidate was ever verified
    APPROVED = "approved"
    DECLINED = "declined"
    SKIPPED = "skipped"  # the operator wants another than this candidate
    TAKEN = "taken"  # the operator wants that candidate first
    ARRIVED = "arrived"
    NEXT_POSE = "next_pose"
    UNREACHED = "unreached"
    MATCHED = "matched"
    LOW_VISIBILITY = "low_visibility"
    DOUBTFUL = "doubtful"  # a first look decides neither way
    UNLOOKED = "unlooked"  # perception could not look at this one frame
    LOOKED_AGAIN = "looked_again"
    REJECTED = "rejected"
    EXCLUDED = "excluded"
    BUDGET_REACHED = "budget_reached"
    STOP = "stop"
    FAULT = "fault"


class End(StrEnum):
    """How a mission ends; the value is the final state's name in capitals."""

    CONFIRMED = "CONFIRMED"
    FAILED = "FAILED"
    NAVIGATION_FAILED = "NAVIGATION_FAILED"
    CANCELLED = "CANCELLED"
    FAULT = "FAULT"


NO_CANDIDATE_LEFT = "no candidate left"
BUDGET_REACHED = "attempt budget reached"
NOT_FOUND = "not found"
NO_PATH = "the planner finds no path"
NONE_WANTED = f"{NO_CANDIDATE_LEFT} that the operator wants"
USE_THE_REMOTE = "the robot may still be moving: use the remote"

# When each end is reached, for docs/mission.md and the console.
ENDS = {
    End.CONFIRMED: "Visibility, semantic and geometric checks all passed at a candidate.",
    End.FAILED: f"At least one candidate was verified and none confirmed: {NO_CANDIDATE_LEFT}, or {BUDGET_REACHED}; or "
    f"{NOT_FOUND}, and nothing was driven to.",
    End.NAVIGATION_FAILED: "No candidate could be verified: none was left that the robot could reach and see.",
    End.CANCELLED: "The operator stopped, declined or did not answer, or somebody else cancelled or replaced the goal.",
    End.FAULT: "Nav2, localisation, a sensor, perception or the link was lost, the memory changed, or a cancel went "
    "unanswered.",
}

# How the end of a navigation goal reads to the mission. Somebody else's hand on the robot ends the mission: a second
# goal from us would fight with them. UNREACHED is first tried from the next-best goal pose.
NAVIGATION_EVENTS = {
    NavigationStatus.SUCCEEDED: Event.ARRIVED,
    NavigationStatus.ABORTED: Event.UNREACHED,
    NavigationStatus.REJECTED: Event.UNREACHED,
    NavigationStatus.TIMED_OUT: Event.UNREACHED,
    NavigationStatus.CANCELED: Event.STOP,
    NavigationStatus.PREEMPTED: Event.STOP,
    NavigationStatus.LOST: Event.FAULT,
    NavigationStatus.STILL_MOVING: Event.FAULT,
}

# What the operator is told when an event happens; {because} is the event's reason, {label} the candidate's name.
TOLD = {
    Event.UNSEEN: "Setting the {label} aside: {because}",
    Event.NEXT_POSE: "Trying the {label} from another side: {because}",
    Event.UNREACHED: "Setting the {label} aside: {because}",
    Event.LOW_VISIBILITY: "Looking at the {label} again: {because}",
    Event.DOUBTFUL: "Looking at the {label} once more: {because}",
    Event.UNLOOKED: "Looking at the {label} again: {because}",
    Event.REJECTED: "This {label} is not confirmed: {because}",
}

# Events that end a mission and are not a FAULT already: the memory is compared with its beginning before they count.
ENDING = {
    Event.NOT_FOUND,
    Event.EXHAUSTED,
    Event.NONE_VERIFIED,
    Event.DECLINED,
    Event.MATCHED,
    Event.BUDGET_REACHED,
    Event.STOP,
}

# The operator's answers to "may I?".
REPLIES = {
    Approval.YES: (Event.APPROVED, "the operator said yes"),
    Approval.NO: (Event.DECLINED, "the operator said no"),
    Approval.NOT_THIS_ONE: (Event.SKIPPED, "the operator said: not this one"),
    Approval.TAKE: (Event.TAKEN, "the operator chose another candidate"),
    Approval.EXPIRED: (Event.DECLINED, "nobody answered in time"),
    Approval.STOP: (Event.STOP, "the operator said stop"),
}


@dataclass(frozen=True, slots=True)
class Step:
    """What a state reports: the event, and why, in words for the operator and the trial."""

    event: Event
    because: str
    stood_ns: int | None = None  # with ARRIVED: the stamp at which the robot was seen to stand


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of a mission. `visits` counts verified candidates; object ids are the memory's."""

    end: End
    reason: str
    visits: int
    object_id: int | None  # the confirmed object
    rejected: tuple[int, ...]  # R_q, in the order of rejection
    set_aside: tuple[int, ...]  # U: unreached, no pose can see it, or declined
    declined: tuple[int, ...] = ()  # the part of U that the operator did not want

    def as_json(self) -> dict[str, Any]:
        """The one form in which ask, run, demo and replay give a mission's outcome to programs."""
        return {
            "outcome": str(self.end),
            "reason": self.reason,
            "visits": self.visits,
            "object_id": self.object_id,
            "rejected": list(self.rejected),
            "set_aside": list(self.set_aside),
            "declined": list(self.declined),
        }
