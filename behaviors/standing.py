"""Does the robot stand? Looked at, never inferred from what a navigator says."""

from __future__ import annotations

from collections import deque

from drivers.ports import StampedPose
from openbelief.pose import wrap_angle

STILL_S = 0.5
STILL_M_S, STILL_RAD_S = 0.05, 0.2  # localisation that wanders moves the pose too, and no faster than this
LOOKS_MIN = 3  # a pose before and one after could be two ends of a step


class Stillness:
    """Looks at one robot, in order; `stands` once it stood still for STILL_S by the looks' own stamps.

    A pose that is told again under the same stamp is no look, so data that stands still never makes a robot stand.
    """

    def __init__(self) -> None:
        self._looks: deque[StampedPose] = deque()

    def see(self, look: StampedPose) -> None:
        newest_ns = self._looks[-1].stamp_ns if self._looks else None
        if newest_ns is not None and look.stamp_ns < newest_ns:
            self._looks.clear()  # the robot's clock was set back: what was seen before says nothing any more
        elif look.stamp_ns == newest_ns:
            return
        self._looks.append(look)
        while len(self._looks) > 1 and self._span_s(1) >= STILL_S:
            self._looks.popleft()

    @property
    def stands(self) -> bool:
        return len(self._looks) >= LOOKS_MIN and self._span_s(0) >= STILL_S and self.moved <= 1.0

    @property
    def moved(self) -> float:
        """How far the robot came from its first look, as a share of what still counts as standing."""
        if not self._looks:
            return 0.0
        first = self._looks[0].pose
        moved_m = max(look.pose.distance_to(first) for look in self._looks)
        turned_rad = max(abs(wrap_angle(look.pose.yaw - first.yaw)) for look in self._looks)
        return max(moved_m / (STILL_M_S * STILL_S), turned_rad / (STILL_RAD_S * STILL_S))

    @property
    def last(self) -> StampedPose | None:
        return self._looks[-1] if self._looks else None

    def _span_s(self, index: int) -> float:
        """From that look to the newest."""
        return (self._looks[-1].stamp_ns - self._looks[index].stamp_ns) / 1e9
