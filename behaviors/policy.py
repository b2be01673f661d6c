"""What is configured about missions: who approves motion, how fresh data must be, how long a drive may take."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

from pydantic.dataclasses import dataclass

from openbelief.settings import CHECKED, Positive, in_one_line


@in_one_line("Mission policy")
@dataclass(frozen=True, kw_only=True, config=CHECKED)
class MissionPolicy:
    """Raises ValueError on a number that is not finite and positive."""

    motion: Literal["ask", "allow"] = "ask"  # "ask": no candidate is driven to without a person's yes
    unseen: Literal["ask", "set aside"] = "ask"  # what no pose can see: a person may send the robot there all the same
    confirm_timeout_s: Positive = 10.0
    camera_max_age_s: Positive = 0.5
    cloud_max_age_s: Positive = 1.0
    pose_max_age_s: Positive = 0.5
    pose_error_m: Positive = 0.10  # localisation error allowed for at arrival
    navigation_timeout_s: Positive = 180.0
    standing: Literal["checked", "inferred"] = "checked"  # "inferred": from the goal's end, in old trials
    goal_tolerance_m: Positive = 0.5  # a robot that stands further from its goal has not arrived
    readout: Literal["grounded", "consensus", "early", "belief"] = "grounded"  # "consensus": the paper's on the robot
    # Is it what was asked for? "relative": asks the map again with what is seen there; "paper": one threshold tau_q.
    arrival_check: Literal["relative", "paper"] = "relative"
    unlooked: Literal["look again", "fault"] = "look again"  # at one lost frame; "fault": old trials
    # What is in doubt ("grounded" only): "ask" a person where it is unsure, "refuse" that too (nobody is there to ask),
    # or "insist" and drive whatever the map says.
    doubt: Literal["ask", "refuse", "insist"] = "ask"

    def to_dict(self) -> dict[str, Any]:
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> MissionPolicy:
        """Raises ValueError naming an unknown key."""
        return cls(**values)
