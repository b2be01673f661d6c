"""The ports of a mission that a person attends: a silent page holds the robot, and a STOP ends every wait at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from behaviors.safety_conditions import OPERATOR_SILENT
from drivers.clock import SystemClock
from drivers.ports import Clock, Ports, Reaction, Safety, SafetyVerdict
from openbelief.pose import Pose2
from robot_app.mission.operator import SharedOperator


def attended(ports: Ports, operator: SharedOperator) -> Ports:
    """The same bodies. A simulated clock stays as it is: its time passes only while somebody sleeps on it."""
    clock = AlertClock(ports.clock, operator) if isinstance(ports.clock, SystemClock) else ports.clock
    return replace(ports, clock=clock, safety=PresenceSafety(ports.safety, operator.silence))


class PresenceSafety:
    """The Safety port: what the supervisor says, and HOLD while whoever commands has no page on a screen."""

    def __init__(self, safety: Safety | None, silence: Callable[[], str | None]) -> None:
        self._safety, self._silence = safety, silence

    def verdict(self, goal: Pose2 | None) -> SafetyVerdict:
        verdict = SafetyVerdict() if self._safety is None else self._safety.verdict(goal)
        if goal is None or verdict.reaction in (Reaction.HOLD, Reaction.CANCEL):
            return verdict
        silent = self._silence()
        return SafetyVerdict(Reaction.HOLD, OPERATOR_SILENT, silent) if silent else verdict


class AlertClock:
    """The Clock port: a sleep ends early when STOP comes, so that nobody waits for the next poll."""

    def __init__(self, clock: Clock, operator: SharedOperator) -> None:
        self._clock, self._operator = clock, operator

    def now_ns(self) -> int:
        return self._clock.now_ns()

    def sleep(self, seconds: float) -> None:
        if self._operator.stop_requested() is not None:
            self._clock.sleep(seconds)  # it was heard: what follows takes the time that it needs
        else:
            self._operator.await_stop(max(seconds, 0.0))
