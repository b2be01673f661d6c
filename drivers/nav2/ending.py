"""Whether a goal has ended, and how: from its result, its status, and how long nothing was heard of it."""

from __future__ import annotations

from drivers.nav2.cancel_replies import cancel_code
from drivers.nav2.cancelling import Cancelling
from drivers.nav2.goal import NavigationGoal
from drivers.nav2.limits import Nav2Limits
from drivers.nav2.readiness import SEVERAL_SERVERS, Nav2Readiness
from drivers.nav2.result import SAID, navigation_result, result_from_status
from drivers.ports import Clock, LinkLost, NavigationResult, NavigationStatus
from drivers.ros import action
from drivers.ros.action import ActionClient
from drivers.ros.messages import Message

RESULTS_ASKED = 3  # for a goal that its status says has ended, before a cancel decides


class Ending:
    """Every way in which a goal of navigate_to_pose ends; one that is lost from sight is cancelled."""

    def __init__(
        self, navigate: ActionClient, readiness: Nav2Readiness, cancelling: Cancelling, clock: Clock, limits: Nav2Limits
    ) -> None:
        self._navigate, self._readiness, self._cancelling = navigate, readiness, cancelling
        self._clock, self._limits = clock, limits

    def of(self, track: NavigationGoal) -> NavigationResult | None:
        """None while the goal is under way."""
        return self._doubled(track) or self._ended(track) or self._overdue(track)

    def ask_result(self, track: NavigationGoal) -> None:
        """One get_result waits at the server while the goal runs."""
        if track.take_question():
            try:
                self._navigate.get_result_later(track.uuid, self._limits.result_wait_s, track.keep)
            except LinkLost:
                track.waiting = False
                raise

    def several(self, track: NavigationGoal, count: int) -> NavigationResult:
        """More than one server took the goal: cancelled at each of them."""
        return self._cancelling.lose(track, f"{count} {SEVERAL_SERVERS}")

    def _doubled(self, track: NavigationGoal) -> NavigationResult | None:
        return self.several(track, 2) if track.doubled or self._readiness.doubled else None

    def _ended(self, track: NavigationGoal) -> NavigationResult | None:
        answer = track.answer
        if answer is None and (track.status in action.TERMINAL or track.forgotten):
            track.asked += 1
            answer = self._navigate.get_result(track.uuid, self._limits.result_ask_s)
        if answer is not None and len(answer.every) > 1:
            return self.several(track, len(answer.every))
        if answer is not None and answer.message is not None:
            return self._judge(track, answer.message)
        if track.asked >= RESULTS_ASKED:
            return self._unproven(track)
        if track.status not in action.TERMINAL:
            self.ask_result(track)
        return None

    def _judge(self, track: NavigationGoal, response: Message) -> NavigationResult | None:
        if response.status in action.TERMINAL:
            return navigation_result(response.status, response.result, replaced=track.replaced)
        if track.status in action.TERMINAL:
            return result_from_status(track.status, replaced=track.replaced)
        if response.status == action.UNKNOWN:
            return self._cancelling.lose(
                track, "Nav2 does not know the goal any more: it was restarted, or the result expired."
            )
        track.answer = None  # "still running" is no result
        return None

    def _unproven(self, track: NavigationGoal) -> NavigationResult:
        """Its status says that it ended, and no result comes: the answer to a cancel says whether that is true."""
        status = track.status
        code = cancel_code(self._navigate.cancel(track.uuid, self._limits.cancel_s), track.uuid)
        if code == action.CANCEL_TERMINATED and status in action.TERMINAL:
            return result_from_status(status, replaced=track.replaced)
        reason = f"Nav2's status says {SAID.get(status, 'nothing of the goal any more')}, its result does not."
        if code == action.CANCEL_OK:
            said = f"{reason} The goal was under way all the same, and was cancelled."
            return NavigationResult(NavigationStatus.LOST, said)
        return self._cancelling.lose(track, reason)

    def _overdue(self, track: NavigationGoal) -> NavigationResult | None:
        now_ns = self._clock.now_ns()
        silent_s, running_s = (now_ns - track.heard_ns) / 1e9, (now_ns - track.sent_ns) / 1e9
        if silent_s > self._limits.silence_s:
            reason = f"{self._readiness.whose_silence()} Nothing was heard for {silent_s:.1f} s."
            return self._cancelling.lose(track, reason)
        if running_s > self._limits.goal_s:
            stopped = self._cancelling.cancel(track, f"the goal took longer than {self._limits.goal_s:g} s")
            in_time = stopped.status == NavigationStatus.CANCELED
            return NavigationResult(NavigationStatus.TIMED_OUT, stopped.reason) if in_time else stopped
        return None
