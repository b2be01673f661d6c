"""Cancelling a goal, and halting every goal of Nav2: each ends in what an operator must know."""

from __future__ import annotations

from collections.abc import Callable

from drivers.nav2.cancel_replies import all_refused, cancel_code, not_halted
from drivers.nav2.goal import NavigationGoal
from drivers.nav2.limits import Nav2Limits
from drivers.nav2.result import navigation_result, result_from_status
from drivers.ports import Clock, LinkLost, NavigationResult, NavigationStatus
from drivers.ros import action
from drivers.ros.action import ActionClient

CANCEL_PAUSE_S = 0.05  # a link that just dropped may be back
STILL_MOVING = "The robot may still be moving: use the remote."


class Cancelling:
    """Asks the navigate_to_pose server to cancel; STILL_MOVING unless an answer proves that it did."""

    def __init__(self, navigate: ActionClient, clock: Clock, limits: Nav2Limits) -> None:
        self._navigate, self._clock, self._limits = navigate, clock, limits

    def cancel(self, track: NavigationGoal, because: str) -> NavigationResult:
        """The goal; where that was not taken, all goals."""
        try:
            answer = self._navigate.cancel(track.uuid, self._limits.cancel_s)
            code = cancel_code(answer, track.uuid)
            if code == action.CANCEL_OK:
                return NavigationResult(NavigationStatus.CANCELED, f"The goal was cancelled: {because}.")
            if code == action.CANCEL_TERMINATED or (code is not None and track.status in action.TERMINAL):
                return self._had_ended(track)
            return self._cancel_all(track, because, code)
        except LinkLost as error:
            return NavigationResult(NavigationStatus.STILL_MOVING, f"{error} {STILL_MOVING}")

    def lose(self, track: NavigationGoal, reason: str) -> NavigationResult:
        """A goal that we lost sight of is cancelled all the same: the robot must not drive on unwatched."""
        stopped = self.cancel(track, "it was lost from sight")
        if stopped.status == NavigationStatus.STILL_MOVING:
            return NavigationResult(NavigationStatus.STILL_MOVING, f"{reason} {STILL_MOVING}")
        return NavigationResult(NavigationStatus.LOST, f"{reason} {stopped.reason}")

    def halt(self, known: Callable[[], list[bytes]], because: str) -> NavigationResult:
        """All goals, and each that is known to run, asked for at once; a second time where that failed."""
        why = None
        try:
            for again in (False, True):
                if again:
                    self._clock.sleep(CANCEL_PAUSE_S)
                uuids = known()
                every, *each = self._navigate.cancel_each([action.ALL_GOALS, *uuids], self._limits.cancel_s)
                why = not_halted(every, list(zip(uuids, each, strict=True)))
                if why is None:
                    said = f"All goals of Nav2 were cancelled: {because}."
                    return NavigationResult(NavigationStatus.CANCELED, said)
        except LinkLost as error:
            return NavigationResult(NavigationStatus.STILL_MOVING, f"{error} {STILL_MOVING}")
        return NavigationResult(NavigationStatus.STILL_MOVING, f"The cancel was not taken: {why}. {STILL_MOVING}")

    def _had_ended(self, track: NavigationGoal) -> NavigationResult:
        """The goal ended before the cancel came: how?"""
        answer = track.answer or self._navigate.get_result(track.uuid, self._limits.result_ask_s)
        if answer.message is not None and answer.message.status in action.TERMINAL:
            return navigation_result(answer.message.status, answer.message.result, replaced=track.replaced)
        if track.status in action.TERMINAL:
            return result_from_status(track.status, replaced=track.replaced)
        return NavigationResult(NavigationStatus.LOST, "The goal had ended before it was cancelled; how is not known.")

    def _cancel_all(self, track: NavigationGoal, because: str, code: int | None) -> NavigationResult:
        """code: the answer to the cancel of this goal, None where there was none."""
        if code is None:
            self._clock.sleep(CANCEL_PAUSE_S)
        answer = self._navigate.cancel(action.ALL_GOALS, self._limits.cancel_s)
        if code == action.CANCEL_REJECTED:  # it knows the goal: it must say that it cancels it
            refused = cancel_code(answer, track.uuid) != action.CANCEL_OK
        else:
            refused = all_refused(answer)
        if refused:
            why = answer.why or "Nav2 refused"
            return NavigationResult(NavigationStatus.STILL_MOVING, f"The cancel was not taken: {why}. {STILL_MOVING}")
        if code == action.CANCEL_UNKNOWN_GOAL:
            return NavigationResult(
                NavigationStatus.LOST, "Nav2 did not know the goal that was to be cancelled; all goals were cancelled."
            )
        return NavigationResult(NavigationStatus.CANCELED, f"All goals of Nav2 were cancelled: {because}.")
