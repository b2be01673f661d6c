"""May the robot move? A pure judgement over what is known now, condition by condition.

Time is monotonic and belongs to us: a sample is as old as the moment at which it last *changed* here. So data that is
missing, a stamp that stands still and the same picture under new stamps are all caught, and a clock that jumps by an
hour, ours or the robot's, changes nothing.
"""

from __future__ import annotations

import math
from collections import deque

from behaviors.safety_conditions import CONDITIONS, GRAVITY
from behaviors.safety_facts import Ages, Known, SafetyFacts
from behaviors.safety_policy import SafetyPolicy
from drivers.ports import SafetyVerdict
from openbelief.pose import Pose2, wrap_angle

SPEED_MAX, TURN_MAX = 1.5, 2.0  # m/s and rad/s: no G1 under Nav2 is faster
JUMP_WINDOW_NS = 1_000_000_000  # a pose is compared with those of so long before, and with the last one before a gap


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
