"""The goals that run by Nav2's own word, and what its answers to "cancel every goal" are worth beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from drivers.ros import action
from drivers.ros.messages import Message

TAKEN = (action.CANCEL_OK, action.CANCEL_UNKNOWN_GOAL, action.CANCEL_TERMINATED)  # no goal runs on after these


class RunningGoals:
    """Several servers may tell, each of its own goals: one runs until its end is told, or until no server is left."""

    def __init__(self) -> None:
        self._running: frozenset[bytes] = frozenset()  # replaced, never changed: heard and read on different threads

    def __bool__(self) -> bool:
        return bool(self._running)

    def hear(self, statuses: Mapping[bytes, int]) -> None:
        """One status array."""
        runs = {uuid for uuid, status in statuses.items() if status in (action.ACCEPTED, action.EXECUTING)}
        self._running = (self._running - statuses.keys()) | runs

    def forget(self) -> None:
        """No server is left: a Nav2 that is started again knows none of them, and says nothing before its first."""
        self._running = frozenset()

    def code(self, replies: Sequence[Message]) -> int:
        """The gravest of the servers' codes; REJECTED where none names a goal that runs: rclpy refuses with "ok"."""
        refused = [int(reply.return_code) for reply in replies if int(reply.return_code) not in TAKEN]
        if refused:
            return refused[0]
        named = {bytes(info.goal_id.uuid) for reply in replies for info in reply.goals_canceling}
        return int(replies[0].return_code) if self._running <= named else action.CANCEL_REJECTED
