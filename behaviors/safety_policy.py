"""What is configured about safety: the [safety] table of robot.toml."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass as settings

from openbelief.settings import CHECKED, Number, Positive, Whole, in_one_line

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
