"""Prints, as hex, what rclpy writes for messages whose bytes a test wants to know. Runs in .venv-ros."""

from __future__ import annotations

import json

from geometry_msgs.msg import PoseStamped
from nav_msgs.srv import GetPlan
from rclpy.serialization import serialize_message
from std_srvs.srv import Trigger


def pose(frame_id: str, x: float) -> PoseStamped:
    stamped = PoseStamped()
    stamped.header.frame_id, stamped.pose.position.x, stamped.pose.orientation.w = frame_id, x, 1.0
    return stamped


MESSAGES = {
    "two poses in a row": GetPlan.Request(start=pose("map", 1.0), goal=pose("", 0.0), tolerance=0.0),
    "empty request": Trigger.Request(),
}

if __name__ == "__main__":
    print(json.dumps({name: bytes(serialize_message(message)).hex() for name, message in MESSAGES.items()}))
