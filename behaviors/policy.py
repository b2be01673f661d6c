"""What a site decides about its missions: who approves motion, how fresh data must be, how long a drive may take."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True, kw_only=True)
class MissionPolicy:
    """Raises ValueError on a number that is not finite and positive."""

    motion: Literal["ask", "allow"] = "ask"  # "ask": no candidate is driven to without a person's yes
    unseen: Literal["ask", "set aside"] = "ask"  # what no pose can see: a person may send the robot there all the same
    confirm_timeout_s: float = 10.0
    camera_max_age_s: float = 0.5
    cloud_max_age_s: float = 1.0
    pose_max_age_s: float = 0.5
    pose_error_m: float = 0.10  # localisation error allowed for at arrival
    navigation_timeout_s: float = 180.0
    readout: Literal["consensus", "early", "belief"] = "consensus"  # the paper's choice on the robot

    def __post_init__(self) -> None:
        for name, value in self.to_dict().items():
            if isinstance(value, float) and not (math.isfinite(value) and value > 0):
                raise ValueError(f"Mission policy {name} must be greater than 0, got {value}.")

    def to_dict(self) -> dict[str, Any]:
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> MissionPolicy:
        """Raises ValueError naming an unknown key."""
        known = {spec.name for spec in dataclasses.fields(cls)}
        if unknown := sorted(set(values) - known):
            raise ValueError(f"Unknown mission policy {unknown[0]!r}; known are {', '.join(sorted(known))}.")
        return cls(**values)
