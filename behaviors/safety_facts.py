"""What is known now about the robot's safety, and how old it is."""

from __future__ import annotations

from dataclasses import dataclass, field

from behaviors.safety_policy import SafetyPolicy
from openbelief.pose import Pose2


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
