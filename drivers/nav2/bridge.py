"""Nav2 behind zenoh-bridge-ros2dds, as the Navigator port. docs/nav2.md has the table of how each failure ends."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from drivers.nav2.cancelling import Cancelling
from drivers.nav2.ending import Ending
from drivers.nav2.goal import NavigationGoal
from drivers.nav2.limits import Nav2Limits
from drivers.nav2.planner import Nav2Planner
from drivers.nav2.readiness import Nav2Readiness
from drivers.nav2.result import REJECTED
from drivers.ports import (
    Clock,
    Map,
    NavigationFeedback,
    NavigationResult,
    NavigationStatus,
    PathPlan,
    PortError,
    PoseSource,
)
from drivers.ros import action
from drivers.ros.action import ActionClient
from drivers.ros.bridge_keys import BridgeKeys, Keys
from drivers.ros.convert import pose_message
from drivers.ros.messages import Message
from drivers.ros.shapes import AUTO, shapes_of
from drivers.ros.zenoh_link import ZenohLink
from drivers.topics import COMPUTE_PATH_TO_POSE, NAVIGATE_TO_POSE
from openbelief.pose import Pose2

OTHERS_MAX = 8  # goals of others that a halt asks for one by one
STOP_POLL_S = 0.02


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
        self._planner = Nav2Planner(ActionClient(link, keys, COMPUTE_PATH_TO_POSE, shapes), self._limits, new_uuid)
        self.readiness = Nav2Readiness(link, keys, shapes, poses, grid, pose_age_s=self._limits.pose_age_s)
        self._cancelling = Cancelling(self._navigate, clock, self._limits)
        self._ending = Ending(self._navigate, self.readiness, self._cancelling, clock, self._limits)
        self._statuses: dict[bytes, int] = {}
        self._goal: NavigationGoal | None = None

    def start(self) -> None:
        """Begin to hear status, feedback and liveliness; all of it ends with the link."""
        self._navigate.listen(self._on_feedback, self._on_status, self._on_acceptance)
        self.readiness.start()

    @property
    def distributions(self) -> tuple[str, ...]:
        """The ROS distributions that agree with all that Nav2 said so far; "jazzy" stands for Kilted too."""
        return self._shapes.distributions

    # The Navigator port

    def unavailable(self) -> str | None:
        self._link.check()
        return next((sign.sentence for sign in self.readiness.read() if not sign.ok), None)

    def plan(self, goal: Pose2) -> PathPlan:
        """Raises LinkLost or PortError where the planner makes no statement on the path."""
        return self._planner.plan(goal)

    def send(self, goal: Pose2) -> NavigationResult | None:
        if self._goal is not None and self._goal.end is None:
            raise PortError("A goal is under way: cancel it before sending another.")
        self._link.check()
        now_ns = self._clock.now_ns()
        self._goal = track = NavigationGoal(self._new_uuid(), now_ns, now_ns, frozenset(self._statuses))
        with self._heeding_stop():
            end = self._send(track, pose_message(goal))
        if track.end is not None and end is None:  # cancelled meanwhile, perhaps before the server knew of it
            again = self._cancelling.cancel(track, "it was cancelled while it was being sent")
            end = track.end if track.end.status == again.status else again  # of equal ends the first names the cause
        track.end = end
        if end is None:
            self._ending.ask_result(track)
        return end

    def feedback(self) -> NavigationFeedback | None:
        return self._goal.feedback if self._goal else None

    def result(self) -> NavigationResult | None:
        track = self._goal
        if track is None:
            raise PortError("No goal was sent.")
        if track.end is None:
            track.end = self._ending.of(track)
        return track.end

    def cancel(self, *, because: str) -> NavigationResult:
        track = self._goal
        if track is None:
            return NavigationResult(NavigationStatus.CANCELED, "No goal was under way.")
        if track.end is None:
            track.end = self._cancelling.cancel(track, because)
        return track.end

    def halt(self, *, because: str) -> NavigationResult:
        end = self._cancelling.halt(self._known_goals, because)
        if self._goal is not None and self._goal.end is None:
            self._goal.end = end
        return end

    # Sending

    def _send(self, track: NavigationGoal, pose: Message) -> NavigationResult | None:
        """The first answer counts; without one the same uuid is sent again, which cannot run twice."""
        first = self._navigate.send_goal(track.uuid, self._limits.send_s, pose=pose)
        if len(first.every) > 1:
            return self._ending.several(track, len(first.every))
        if first.message is not None:
            return None if first.message.accepted else REJECTED
        if track.end is not None:  # cancelled: sent again it might begin
            return None
        second = self._navigate.send_goal(track.uuid, self._limits.send_s, pose=pose)
        if len(second.every) > 1:
            return self._ending.several(track, len(second.every))
        if second.message is None:
            return self._cancelling.lose(track, f"Nav2 did not say whether it took the goal: {second.why}.")
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
