"""One navigation goal: its uuid, and the feedback, status and result received for it."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

from drivers.ports import NavigationFeedback, NavigationResult
from drivers.ros import action
from drivers.ros.action import ActionReply
from drivers.ros.convert import pose_of
from drivers.ros.messages import Message


@dataclass
class NavigationGoal:
    """Heard on Zenoh's thread, read on the mission's. before: the goals that the server knew before ours."""

    uuid: bytes
    sent_ns: int
    heard_ns: int
    before: frozenset[bytes]
    status: int = action.UNKNOWN
    replaced: bool = False  # another goal came after ours
    asked: int = 0  # how often a result was asked for after the status said that it had ended
    waiting: bool = False  # a get_result is under way
    forgotten: bool = False  # the server's goals do not hold it any more
    accepted_ns: int | None = None  # by the server's clock
    doubled: bool = False  # two servers accepted it, each at a moment of its own
    answer: ActionReply | None = None
    feedback: NavigationFeedback | None = None
    end: NavigationResult | None = None
    lock: threading.Lock = field(default_factory=threading.Lock)

    def hear_feedback(self, feedback: Message, now_ns: int) -> None:
        """A NavigateToPose_Feedback of this goal; raises WireError where its pose is not in the map frame."""
        self.feedback = NavigationFeedback(
            stamp_ns=now_ns,
            pose=pose_of(feedback.current_pose),
            distance_remaining_m=float(feedback.distance_remaining),
            navigation_time_s=feedback.navigation_time.sec + feedback.navigation_time.nanosec / 1e9,
            recoveries=int(feedback.number_of_recoveries),
        )
        self.heard_ns = now_ns

    def hear_status(self, statuses: dict[bytes, int], now_ns: int) -> None:
        """The status of every goal of the server."""
        if self.uuid in statuses:
            self.status, self.heard_ns = statuses[self.uuid], now_ns
        self.forgotten = self.uuid not in statuses and self.status != action.UNKNOWN
        others = statuses.keys() - self.before - {self.uuid}
        self.replaced = self.replaced or any(statuses[uuid] in action.ACTIVE for uuid in others)

    def hear_acceptance(self, accepted: dict[bytes, int]) -> None:
        """When each goal of a server was accepted. One server never says two things of one goal."""
        if (stamp_ns := accepted.get(self.uuid)) is not None:
            self.doubled = self.doubled or self.accepted_ns not in (None, stamp_ns)
            self.accepted_ns = stamp_ns

    def take_question(self) -> bool:
        """Whether a get_result should be asked now: one at a time."""
        with self.lock:
            asked, self.waiting = not self.waiting, True
            return asked

    def keep(self, answer: ActionReply) -> None:
        """The get_result has ended; without a message it says nothing."""
        with self.lock:
            self.waiting = False
            self.answer = answer if answer.every else self.answer
