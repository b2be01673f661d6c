"""A mapping walk: the robot goes from waypoint to waypoint, and says when it is time for a picture."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from drivers.clock import SimClock
from openbelief.pose import Pose2, wrap_angle
from sim_fakes.world.robot import SimRobot

TICK_S = 0.1
STUCK_S = 120.0


def keyframes(
    robot: SimRobot, clock: SimClock, waypoints: Iterable[Pose2], *, spacing_m: float = 0.6, turn_deg: float = 24.0
) -> Iterator[Pose2]:
    """Walk straight from waypoint to waypoint, turning there to each one's yaw; yields at the start and then wherever
    the robot has gone `spacing_m` or turned `turn_deg` since. Raises RuntimeError where it is blocked."""
    last = robot.pose
    yield last
    for waypoint in waypoints:
        robot.follow(waypoint.xy[None], waypoint.yaw)
        deadline_ns = clock.now_ns() + round(STUCK_S * 1e9)
        while robot.moving:
            clock.sleep(TICK_S)
            if _moved(last, robot.pose, spacing_m, np.deg2rad(turn_deg)):
                last = robot.pose
                yield last
            if clock.now_ns() > deadline_ns:
                raise RuntimeError(f"The walk did not reach x={waypoint.x} y={waypoint.y} within {STUCK_S:.0f} s.")
        if robot.blocked:
            raise RuntimeError(f"The walk to x={waypoint.x} y={waypoint.y} is blocked. {robot.blocked}")


class Walker:
    """The same walk, a step at a time: `step` sends the robot on where it stands, and is False at the walk's end."""

    def __init__(self, robot: SimRobot, clock: SimClock, waypoints: Iterable[Pose2]) -> None:
        self._robot, self._clock, self._waypoints = robot, clock, iter(waypoints)
        self._deadline_ns = 0

    def step(self) -> bool:
        """Raises RuntimeError where the walk is blocked."""
        if self._robot.blocked:
            raise RuntimeError(f"The walk is blocked. {self._robot.blocked}")
        if self._robot.moving:
            if self._clock.now_ns() > self._deadline_ns:
                raise RuntimeError(f"The walk did not reach its next waypoint within {STUCK_S:.0f} s.")
            return True
        waypoint = next(self._waypoints, None)
        if waypoint is None:
            return False
        self._robot.follow(waypoint.xy[None], waypoint.yaw)
        self._deadline_ns = self._clock.now_ns() + round(STUCK_S * 1e9)
        return True


def _moved(before: Pose2, now: Pose2, spacing_m: float, turn_rad: float) -> bool:
    return before.distance_to(now) >= spacing_m or abs(wrap_angle(now.yaw - before.yaw)) >= turn_rad
