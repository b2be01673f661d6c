"""Nav2's /navigate_to_pose for the watchdog's helper: an rclpy ActionServer that drives, and tells of each cancel.

Runs in .venv-ros. What a goal says is of no matter to a cancel, so the type is one of test_msgs. A goal is under way
when it prints "ready"; then one JSON line for each cancel that comes, and for each goal that ended by it. The argument
"refuses" makes it refuse cancels.
"""

from __future__ import annotations

import json
import sys
import time

import lifeline
import rclpy
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from test_msgs.action import Fibonacci

STEP_S = 0.02


def say(**words: object) -> None:
    sys.stdout.write(json.dumps(words) + "\n")
    sys.stdout.flush()


class Nav2(Node):
    def __init__(self, *, refuses: bool) -> None:
        super().__init__("bt_navigator_stand_in")
        self._refuses, together = refuses, ReentrantCallbackGroup()
        self._server = ActionServer(
            self,
            Fibonacci,
            "/navigate_to_pose",
            execute_callback=self.drive,
            cancel_callback=self.cancel,
            callback_group=together,
        )
        self._client = ActionClient(self, Fibonacci, "/navigate_to_pose", callback_group=together)
        self._ready = False

    def send_goal(self) -> None:
        self._client.wait_for_server()
        self._client.send_goal_async(Fibonacci.Goal(order=1))

    def drive(self, goal) -> Fibonacci.Result:
        if not self._ready:
            self._ready = True
            lifeline.ready()
        while rclpy.ok():
            if goal.is_cancel_requested:
                goal.canceled()
                say(stopped_ns=time.monotonic_ns())
                return Fibonacci.Result()
            time.sleep(STEP_S)
        return Fibonacci.Result()

    def cancel(self, goal) -> CancelResponse:
        say(cancel_ns=time.monotonic_ns())
        return CancelResponse.REJECT if self._refuses else CancelResponse.ACCEPT


def main(*words: str) -> None:
    rclpy.init()
    executor, node = MultiThreadedExecutor(num_threads=4), Nav2(refuses="refuses" in words)
    executor.add_node(node)
    executor.create_task(node.send_goal)
    executor.spin()


if __name__ == "__main__":
    main(*sys.argv[1:])
