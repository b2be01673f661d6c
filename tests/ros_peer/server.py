"""A real ROS 2 node: an action server, a latched map and the Trigger of a lifecycle manager, on rclpy and Fast-DDS.

Runs in .venv-ros. The goal's `order` says what happens.
"""

from __future__ import annotations

import time

import lifeline
import rclpy
from nav_msgs.msg import OccupancyGrid
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

STEP_S = 0.1
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE)
REFUSES_CANCEL, ABORTS = 1, 2  # thousands, added to the number of steps; a negative order is rejected


class Server(Node):
    """Counts as many steps as the goal orders, one feedback each."""

    def __init__(self) -> None:
        super().__init__("peer_server")
        together = ReentrantCallbackGroup()
        self.action = ActionServer(
            self,
            Fibonacci,
            "/fibonacci",
            execute_callback=self.execute,
            goal_callback=lambda goal: GoalResponse.REJECT if goal.order < 0 else GoalResponse.ACCEPT,
            cancel_callback=self.cancel,
            callback_group=together,
        )
        self.create_service(Trigger, "/lifecycle_manager_navigation/is_active", self.is_active)
        self.create_publisher(OccupancyGrid, "/map", LATCHED).publish(self.map())

    def execute(self, handle) -> Fibonacci.Result:
        special, steps = divmod(handle.request.order, 1000)
        sequence: list[int] = []
        for step in range(steps):
            if handle.is_cancel_requested:
                handle.canceled()
                return Fibonacci.Result(sequence=sequence)
            sequence.append(step)
            handle.publish_feedback(Fibonacci.Feedback(sequence=sequence))
            time.sleep(STEP_S)
        (handle.abort if special == ABORTS else handle.succeed)()
        return Fibonacci.Result(sequence=sequence)

    def cancel(self, handle) -> CancelResponse:
        return CancelResponse.REJECT if handle.request.order // 1000 == REFUSES_CANCEL else CancelResponse.ACCEPT

    def is_active(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, "active"
        return response

    def map(self) -> OccupancyGrid:
        """5 x 4 cells of 0.5 m from (-1, -2): free, but for one occupied and one unknown."""
        grid = OccupancyGrid()
        grid.header.frame_id = "map"
        grid.info.resolution, grid.info.width, grid.info.height = 0.5, 5, 4
        grid.info.origin.position.x, grid.info.origin.position.y = -1.0, -2.0
        grid.data = [100 if cell == 7 else -1 if cell == 12 else 0 for cell in range(20)]
        return grid


def main() -> None:
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=8)
    executor.add_node(Server())
    lifeline.ready()
    executor.spin()


if __name__ == "__main__":
    main()
