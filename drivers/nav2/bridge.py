"""Nav2 behind zenoh-bridge-ros2dds, as the Navigator port. docs/nav2.md has the table of how each failure ends."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from drivers.nav2.cancelling import all_refused, cancel_code, not_halted
from drivers.nav2.goal import NavigationGoal
from drivers.nav2.readiness import SEVERAL_SERVERS, Nav2Readiness
from drivers.nav2.result import REJECTED, SAID, navigation_result, path_plan, result_from_status
from drivers.ports import (
    Clock,
    LinkLost,
    Map,
    NavigationFeedback,
    NavigationResult,
    NavigationStatus,
    PathPlan,
    PortError,
    PoseSource,
)
from drivers.ros import action
from drivers.ros.action import ActionClient, ActionReply
from drivers.ros.bridge_keys import BridgeKeys, Keys
from drivers.ros.convert import pose_message
from drivers.ros.messages import Message
from drivers.ros.shapes import AUTO, shapes_of
from drivers.ros.zenoh_link import ZenohLink
from drivers.topics import COMPUTE_PATH_TO_POSE, NAVIGATE_TO_POSE
from openbelief.pose import Pose2

CANCEL_PAUSE_S = 0.05
OTHERS_MAX = 8  # goals of others that a halt asks for one by one
STOP_POLL_S = 0.02
STILL_MOVING = "The robot may still be moving: use the remote."


@dataclass(frozen=True)
class Nav2Limits:
    """Seconds. Time-outs of queries are wall time, everything else is the clock's."""

    send_s: float = 1.0  # twice, a goal as a question for a path
    plan_s: float = 5.0
    result_wait_s: float = 600.0  # one get_result waits at the server, and is asked again where it ends unanswered
    result_ask_s: float = 0.5  # once the status says that the goal has ended
    cancel_s: float = 0.45  # twice; with a pause within the 1 s that the port allows
    silence_s: float = 5.0  # no feedback and no status: lost. A reconnection takes up to 4 s
    goal_s: float = 600.0  # no goal takes longer
    pose_age_s: float = 0.5


class Nav2Bridge:
    """The Navigator port over Zenoh.

    new_uuid gives each goal its 16 bytes. poses and grid are the ports whose freshness is part of "Nav2 is up".
    distribution: a ROS distribution's name, or "auto" for the one whose shapes decode. stop: why the operator wants the
    robot to stop, None where nobody does; asked while `send` waits for Nav2, which may already drive.
    """

    def __init__(
        self,
        link: ZenohLink,
        clock: Clock,
        poses: PoseSource,
        grid: Map,
        *,
        new_uuid: Callable[[], bytes],
        keys: Keys | None = None,
        distribution: str = AUTO,
        limits: Nav2Limits | None = None,
        stop: Callable[[], str | None] = lambda: None,
    ) -> None:
        self._link, self._clock, self._new_uuid, self._stop = link, clock, new_uuid, stop
        self._limits = limits or Nav2Limits()
        keys, shapes = keys or BridgeKeys(), shapes_of(distribution)
        self._shapes = shapes
        self._navigate = ActionClient(link, keys, NAVIGATE_TO_POSE, shapes)
        self._planner = ActionClient(link, keys, COMPUTE_PATH_TO_POSE, shapes)
        self.signs = Nav2Readiness(link, keys, shapes, poses, grid, pose_age_s=self._limits.pose_age_s)
        self._statuses: dict[bytes, int] = {}
        self._goal: NavigationGoal | None = None

    def start(self) -> None:
        """Begin to hear status, feedback and liveliness; all of it ends with the link."""
        self._navigate.listen(self._on_feedback, self._on_status, self._on_acceptance)
        self.signs.start()

    @property
    def distributions(self) -> tuple[str, ...]:
        """The ROS distributions that agree with all that Nav2 said so far; "jazzy" stands for Kilted too."""
        return self._shapes.distributions

    # The Navigator port

    def unavailable(self) -> str | None:
        self._link.check()
        return next((sign.sentence for sign in self.signs.read() if not sign.ok), None)

    def plan(self, goal: Pose2) -> PathPlan:
        """Raises LinkLost or PortError where the planner makes no statement on the path."""
        uuid, taken = self._ask_planner(goal)
        if taken.message is None:  # a question or its answer was lost; planning moves nothing, so it is asked anew
            uuid, taken = self._ask_planner(goal)
        if taken.message is None:
            raise LinkLost(f"Nav2's planner does not answer: {taken.why}.")
        if not taken.message.accepted:
            return PathPlan(None, "Nav2's planner rejected the question: is planner_server active?")
        answer = self._planner.get_result(uuid, self._limits.plan_s)
        if answer.message is None:
            raise LinkLost(f"Nav2's planner took the question and gave no path: {answer.why}.")
        return path_plan(answer.message)

    def send(self, goal: Pose2) -> NavigationResult | None:
        if self._goal is not None and self._goal.end is None:
            raise PortError("A goal is under way: cancel it before sending another.")
        self._link.check()
        now_ns = self._clock.now_ns()
        self._goal = track = NavigationGoal(self._new_uuid(), now_ns, now_ns, frozenset(self._statuses))
        with self._heeding_stop():
            end = self._send(track, pose_message(goal))
        if track.end is not None and end is None:  # cancelled meanwhile, perhaps before the server knew of it
            again = self._cancel(track, "it was cancelled while it was being sent")
            end = track.end if track.end.status == again.status else again  # the first knows why
        track.end = end
        if end is None:
            self._ask_result(track)
        return end

    def feedback(self) -> NavigationFeedback | None:
        return self._goal.feedback if self._goal else None

    def result(self) -> NavigationResult | None:
        track = self._goal
        if track is None:
            raise PortError("No goal was sent.")
        if track.end is None:
            track.end = self._doubled(track) or self._ended(track) or self._overdue(track)
        return track.end

    def cancel(self, *, because: str) -> NavigationResult:
        track = self._goal
        if track is None:
            return NavigationResult(NavigationStatus.CANCELED, "No goal was under way.")
        if track.end is None:
            track.end = self._cancel(track, because)
        return track.end

    def halt(self, *, because: str) -> NavigationResult:
        end = self._halt(because)
        if self._goal is not None and self._goal.end is None:
            self._goal.end = end
        return end

    def _ask_planner(self, goal: Pose2) -> tuple[bytes, ActionReply]:
        uuid = self._new_uuid()
        return uuid, self._planner.send_goal(uuid, self._limits.send_s, goal=pose_message(goal))

    # Sending

    def _send(self, track: NavigationGoal, pose: Message) -> NavigationResult | None:
        """The first answer counts; without one the same uuid is sent again, which cannot run twice."""
        first = self._navigate.send_goal(track.uuid, self._limits.send_s, pose=pose)
        if len(first.every) > 1:
            return self._several(track, len(first.every))
        if first.message is not None:
            return None if first.message.accepted else REJECTED
        if track.end is not None:  # cancelled: sent again it might begin
            return None
        second = self._navigate.send_goal(track.uuid, self._limits.send_s, pose=pose)
        if len(second.every) > 1:
            return self._several(track, len(second.every))
        if second.message is None:
            return self._lose(track, f"Nav2 did not say whether it took the goal: {second.why}.")
        return None if second.message.accepted else self._known(track)

    @contextmanager
    def _heeding_stop(self) -> Iterator[None]:
        """A STOP cancels at once, though the mission's thread waits for Nav2's answer."""
        answered = threading.Event()

        def watch() -> None:
            while not answered.wait(STOP_POLL_S):
                if because := self._stop():
                    self.cancel(because=because)
                    return

        watching = threading.Thread(target=watch, name="stop", daemon=True)
        watching.start()
        try:
            yield
        finally:
            answered.set()
            watching.join()

    def _known(self, track: NavigationGoal) -> NavigationResult | None:
        """ "Not accepted" to a repeated uuid means "already running" or "rejected": the server's goals decide."""
        if track.status != action.UNKNOWN:
            return None
        answer = self._navigate.get_result(track.uuid, self._limits.result_ask_s)
        if answer.message is not None and answer.message.status == action.UNKNOWN:
            return REJECTED
        return None  # it waits for the goal's end, or has ended: result() goes on from here

    # Ending

    def _ask_result(self, track: NavigationGoal) -> None:
        """One get_result waits at the server while the goal runs."""
        if track.take_question():
            try:
                self._navigate.get_result_later(track.uuid, self._limits.result_wait_s, track.keep)
            except LinkLost:
                track.waiting = False
                raise

    def _ended(self, track: NavigationGoal) -> NavigationResult | None:
        answer = track.answer
        if answer is None and (track.status in action.TERMINAL or track.forgotten):
            track.asked += 1
            answer = self._navigate.get_result(track.uuid, self._limits.result_ask_s)
        if answer is not None and len(answer.every) > 1:
            return self._several(track, len(answer.every))
        if answer is not None and answer.message is not None:
            return self._judge(track, answer.message)
        if track.asked >= 3:
            return self._unproven(track)
        if track.status not in action.TERMINAL:
            self._ask_result(track)
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
        return self._lose(track, reason)

    def _doubled(self, track: NavigationGoal) -> NavigationResult | None:
        if track.doubled or self.signs.doubled:
            return self._several(track, 2)
        return None

    def _several(self, track: NavigationGoal, count: int) -> NavigationResult:
        """More than one server took the goal: cancelled at each of them."""
        return self._lose(track, f"{count} {SEVERAL_SERVERS}")

    def _judge(self, track: NavigationGoal, response: Message) -> NavigationResult | None:
        if response.status in action.TERMINAL:
            return navigation_result(response.status, response.result, replaced=track.replaced)
        if track.status in action.TERMINAL:
            return result_from_status(track.status, replaced=track.replaced)
        if response.status == action.UNKNOWN:
            return self._lose(track, "Nav2 does not know the goal any more: it was restarted, or the result expired.")
        track.answer = None  # "still running" is no result
        return None

    def _overdue(self, track: NavigationGoal) -> NavigationResult | None:
        now_ns = self._clock.now_ns()
        silent_s, running_s = (now_ns - track.heard_ns) / 1e9, (now_ns - track.sent_ns) / 1e9
        if silent_s > self._limits.silence_s:
            return self._lose(track, f"{self.signs.whose_silence()} Nothing was heard for {silent_s:.1f} s.")
        if running_s > self._limits.goal_s:
            stopped = self._cancel(track, f"the goal took longer than {self._limits.goal_s:g} s")
            in_time = stopped.status == NavigationStatus.CANCELED
            return NavigationResult(NavigationStatus.TIMED_OUT, stopped.reason) if in_time else stopped
        return None

    def _lose(self, track: NavigationGoal, reason: str) -> NavigationResult:
        """A goal that we lost sight of is cancelled all the same: the robot must not drive on unwatched."""
        stopped = self._cancel(track, "it was lost from sight")
        if stopped.status == NavigationStatus.STILL_MOVING:
            return NavigationResult(NavigationStatus.STILL_MOVING, f"{reason} {STILL_MOVING}")
        return NavigationResult(NavigationStatus.LOST, f"{reason} {stopped.reason}")

    # Cancelling

    def _cancel(self, track: NavigationGoal, because: str) -> NavigationResult:
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

    def _had_ended(self, track: NavigationGoal) -> NavigationResult:
        """The goal ended before the cancel came: how?"""
        answer = track.answer or self._navigate.get_result(track.uuid, self._limits.result_ask_s)
        if answer.message is not None and answer.message.status in action.TERMINAL:
            return navigation_result(answer.message.status, answer.message.result, replaced=track.replaced)
        if track.status in action.TERMINAL:
            return result_from_status(track.status, replaced=track.replaced)
        return NavigationResult(NavigationStatus.LOST, "The goal had ended before it was cancelled; how is not known.")

    def _cancel_all(self, track: NavigationGoal, because: str, code: int | None) -> NavigationResult:
        if code is None:
            self._clock.sleep(CANCEL_PAUSE_S)  # a link that just dropped may be back
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

    def _halt(self, because: str) -> NavigationResult:
        """All goals, ours and every other that is known to run, asked for at once; a second time where that failed."""
        why = None
        try:
            for again in (False, True):
                if again:
                    self._clock.sleep(CANCEL_PAUSE_S)  # a link that just dropped may be back
                known = self._known_goals()
                every, *each = self._navigate.cancel_each([action.ALL_GOALS, *known], self._limits.cancel_s)
                why = not_halted(every, list(zip(known, each, strict=True)))
                if why is None:
                    said = f"All goals of Nav2 were cancelled: {because}."
                    return NavigationResult(NavigationStatus.CANCELED, said)
        except LinkLost as error:
            return NavigationResult(NavigationStatus.STILL_MOVING, f"{error} {STILL_MOVING}")
        return NavigationResult(NavigationStatus.STILL_MOVING, f"The cancel was not taken: {why}. {STILL_MOVING}")

    def _known_goals(self) -> list[bytes]:
        """Ours, whatever is believed of it, and those of others that the status calls active."""
        ours = [self._goal.uuid] if self._goal is not None else []
        active = [uuid for uuid, status in self._statuses.items() if status in action.ACTIVE and uuid not in ours]
        return ours + active[:OTHERS_MAX]

    # Hearing (on Zenoh's thread)

    def _on_feedback(self, message: Message) -> None:
        track = self._goal
        if track is not None and bytes(message.goal_id.uuid) == track.uuid:
            track.hear_feedback(message.feedback, self._clock.now_ns())

    def _on_acceptance(self, accepted: dict[bytes, int]) -> None:
        if self._goal is not None:
            self._goal.hear_acceptance(accepted)

    def _on_status(self, statuses: dict[bytes, int]) -> None:
        self._statuses = statuses
        if self._goal is not None:
            self._goal.hear_status(statuses, self._clock.now_ns())
