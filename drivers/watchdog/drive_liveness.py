"""Drive liveness: the heartbeat is withheld while a goal runs that the mission no longer polls.

The heartbeat has a thread of its own, so alone it would beat on while the mission hangs in a full disk or a dead lock,
and the watchdog on the robot would let a robot drive that nobody stops.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from drivers.ports import NavigationFeedback, NavigationResult, Navigator, PathPlan
from openbelief.pose import Pose2

UNWATCHED_S = 0.5  # a mission asks 20 times a second


class DriveLiveness:
    """The Navigator port around another one. `beats` is False where a goal runs that nobody asked for UNWATCHED_S."""

    def __init__(self, navigator: Navigator, now_s: Callable[[], float] = time.monotonic) -> None:
        self._navigator, self._now_s = navigator, now_s
        self._under_way, self._asked_s = False, now_s()

    def beats(self) -> bool:
        return not self._under_way or self._now_s() - self._asked_s <= UNWATCHED_S

    def unavailable(self) -> str | None:
        return self._navigator.unavailable()

    def plan(self, goal: Pose2) -> PathPlan:
        return self._navigator.plan(goal)

    def send(self, goal: Pose2) -> NavigationResult | None:
        end = self._navigator.send(goal)
        self._ask(under_way=end is None)
        return end

    def feedback(self) -> NavigationFeedback | None:
        return self._navigator.feedback()

    def result(self) -> NavigationResult | None:
        end = self._navigator.result()
        self._ask(under_way=end is None)
        return end

    def cancel(self, *, because: str) -> NavigationResult:
        self._ask(under_way=self._under_way)
        end = self._navigator.cancel(because=because)
        self._ask(under_way=False)
        return end

    def halt(self, *, because: str) -> NavigationResult:
        self._ask(under_way=self._under_way)
        end = self._navigator.halt(because=because)
        self._ask(under_way=False)
        return end

    def _ask(self, *, under_way: bool) -> None:
        self._asked_s, self._under_way = self._now_s(), under_way
