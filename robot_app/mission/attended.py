"""The ports of a mission that a person attends: a silent page holds the robot, and a STOP ends every wait at once."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from dataclasses import replace

from behaviors.safety_conditions import OPERATOR_SILENT
from drivers.clock import SystemClock
from drivers.ports import Clock, Interrupted, Ports, Reaction, Safety, SafetyVerdict
from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.ports import Perception
from openbelief.pose import Pose2
from robot_app.mission.operator import SharedOperator

LISTEN_S = 0.02  # between two looks at whether STOP came


def attended(ports: Ports, operator: SharedOperator) -> Ports:
    """The same bodies. A simulated clock stays as it is: its time passes only while somebody sleeps on it."""
    clock = AlertClock(ports.clock, operator) if isinstance(ports.clock, SystemClock) else ports.clock
    perception = AlertPerception(ports.perception, operator)
    return replace(ports, clock=clock, safety=PresenceSafety(ports.safety, operator.silence), perception=perception)


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


class AlertPerception:
    """The Perception port: a STOP does not wait until a model answers, or until a lost server has been waited for.

    Frames are looked at on threads of their own, one at a time: what was asked before a STOP comes to its end, and its
    answer is dropped.
    """

    def __init__(self, perception: Perception, operator: SharedOperator) -> None:
        self._perception, self._operator = perception, operator
        self.id, self.feature_text_aligned = perception.id, perception.feature_text_aligned
        self._masks: Future[list[Mask]] | None = None

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        """Raises Interrupted where STOP comes first."""
        before, masks = self._masks, Future[list[Mask]]()
        self._masks = masks
        threading.Thread(target=self._look, args=(frame, before, masks), daemon=True).start()
        while not wait([masks], LISTEN_S).done:
            if self._operator.stop_requested() is not None:
                raise Interrupted("STOP came while perception looked at the frame.")
        return masks.result()

    def _look(self, frame: RgbdFrame, before: Future[list[Mask]] | None, masks: Future[list[Mask]]) -> None:
        wait([before] if before else [])
        try:
            masks.set_result(self._perception.perceive(frame))
        except BaseException as error:  # noqa: BLE001 - raised where the answer is waited for
            masks.set_exception(error)
