"""Cancels goals with rclpy, for a robot whose Python has it and has no cyclonedds wheel (ARM).

Run by the robot's own ROS Python as a script: it imports nothing of ours. Lines in: "cancel TRIP". Lines out, JSON:
{"trip": TRIP, "code": CODE} for an answer, {"servers": N, "driving": BOOL} five times a second. It ends with its input.
"""

from __future__ import annotations

import json
import sys
import threading
from typing import Any

REJECTED = 1  # action_msgs/CancelGoal
ACTIVE = (1, 2)  # action_msgs/GoalStatus: accepted, executing
PENDING_MAX = 32  # unanswered cancels that are kept
TELL_S = 0.2


def say(**words: Any) -> None:
    print(json.dumps(words), flush=True)


class Helper:
    """Follows the goals of one action, and cancels all of them when a line asks for it.

    `listen` runs on a thread of its own; everything else runs where the node is spun.
    """

    def __init__(self, node: Any, action: str) -> None:
        from action_msgs.msg import GoalStatusArray
        from action_msgs.srv import CancelGoal

        self._node, self._status_topic, self._every_goal = node, f"{action}/_action/status", CancelGoal.Request
        self._running: set[bytes] = set()  # uuids
        self._asked: list[Any] = []  # the newest unanswered cancels
        self._wanted: list[int] = []  # trips to cancel
        self.ended = threading.Event()
        self._client = node.create_client(CancelGoal, f"{action}/_action/cancel_goal")
        self._wake = node.create_guard_condition(self._obey)
        node.create_subscription(GoalStatusArray, self._status_topic, self._hear, latched())
        node.create_timer(TELL_S, self._tell)

    def listen(self) -> None:
        """Take lines until the input ends."""
        for line in sys.stdin:
            word, _, trip = line.strip().partition(" ")
            if word == "cancel":
                self._wanted.append(int(trip))
                self._wake.trigger()
        self._wake.trigger()
        self.ended.set()

    def _obey(self) -> None:
        while self._wanted:
            self._cancel(self._wanted.pop(0))

    def _cancel(self, trip: int) -> None:
        future = self._client.call_async(self._every_goal())  # zero uuid, zero stamp: every goal
        future.add_done_callback(lambda done: self._answer(trip, done.result()))
        self._asked.append(future)
        if len(self._asked) > PENDING_MAX:
            self._client.remove_pending_request(self._asked.pop(0))

    def _answer(self, trip: int, reply: Any) -> None:
        """A server on rclpy refuses with "ok": each goal must be named. Of several servers rclpy gives the first answer
        alone, and one goal may run on each of them: there it acknowledges nothing."""
        named = {bytes(info.goal_id.uuid) for info in reply.goals_canceling}
        taken = self._running <= named and self._servers() <= 1
        say(trip=trip, code=reply.return_code if reply.return_code or taken else REJECTED)

    def _hear(self, array: Any) -> None:
        """Of several servers each tells its own goals only: what it does not name stays; what it ended may run on."""
        alone = self._servers() <= 1
        for status in array.status_list:
            goal = bytes(status.goal_info.goal_id.uuid)
            if status.status in ACTIVE:
                self._running.add(goal)
            elif alone:
                self._running.discard(goal)

    def _tell(self) -> None:
        servers = self._servers()
        if not servers:
            self._running.clear()  # a Nav2 that is started again knows none of them
        say(servers=servers, driving=bool(self._running))

    def _servers(self) -> int:
        """Each action server publishes one status topic."""
        return self._node.count_publishers(self._status_topic) if self._client.service_is_ready() else 0


def latched() -> Any:
    """The quality of service of an action's status topic."""
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    return QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE)


def main(action: str) -> None:
    import rclpy

    rclpy.init()
    node = rclpy.create_node("openbelief_watchdog")
    helper = Helper(node, action)
    threading.Thread(target=helper.listen, daemon=True).start()
    while rclpy.ok() and not helper.ended.is_set():
        rclpy.spin_once(node, timeout_sec=0.1)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "/navigate_to_pose")
