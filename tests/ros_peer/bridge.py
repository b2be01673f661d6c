"""A small stand-in for zenoh-bridge-ros2dds: rclpy on one side; its keys, liveliness tokens and CDR bytes on the other.

Runs in .venv-ros: bridge.py ENDPOINT. The action /fibonacci crosses byte for byte. The same action server is also
offered as Nav2's /navigate_to_pose, for which `nav2_face.py` rewrites goal, result and feedback, and nothing else.
Written from the bridge's documentation, without the project's own code.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from typing import Any

import lifeline
import nav2_face
import rclpy
import zenoh
from action_msgs.msg import GoalStatusArray
from nav_msgs.msg import OccupancyGrid
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci
from zenoh import ext

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE)
SERVICES = {  # the parts of an action
    "send_goal": Fibonacci.Impl.SendGoalService,
    "get_result": Fibonacci.Impl.GetResultService,
    "cancel_goal": Fibonacci.Impl.CancelGoalService,
}
Rewrite = Callable[[bytes], bytes]
FACES: dict[str, tuple[str, dict[str, Rewrite]]] = {  # action name -> type, what is rewritten
    "fibonacci": ("test_msgs/action/Fibonacci", {}),
    "navigate_to_pose": (
        "nav2_msgs/action/NavigateToPose",
        {"send_goal": nav2_face.goal, "get_result": nav2_face.result, "feedback": nav2_face.feedback},
    ),
}


def unchanged(payload: bytes) -> bytes:
    return payload


class Bridge(Node):
    def __init__(self, session: zenoh.Session) -> None:
        super().__init__("bridge_stand_in")
        self._session = session
        self._kept: list[Any] = []
        self._token("")
        for name, (type_name, rewrites) in FACES.items():
            self._offer_action(name, type_name, rewrites)
        is_active = "lifecycle_manager_navigation/is_active"
        self._offer_service(is_active, self.create_client(Trigger, f"/{is_active}"), Trigger)
        self._forward("map", OccupancyGrid, "/map", unchanged, latched=True)

    def _offer_action(self, name: str, type_name: str, rewrites: dict[str, Rewrite]) -> None:
        for part, service in SERVICES.items():
            client = self.create_client(service, f"/fibonacci/_action/{part}")
            rewrite = rewrites.get(part, unchanged)
            request, response = (rewrite, unchanged) if part == "send_goal" else (unchanged, rewrite)
            self._offer_service(f"{name}/_action/{part}", client, service, request, response)
        feedback = rewrites.get("feedback", unchanged)
        self._forward(
            f"{name}/_action/feedback", Fibonacci.Impl.FeedbackMessage, "/fibonacci/_action/feedback", feedback
        )
        self._forward(f"{name}/_action/status", GoalStatusArray, "/fibonacci/_action/status", unchanged, latched=True)
        self._token(f"/AS/{name}/{type_name.replace('/', '§')}")

    def _offer_service(
        self, key: str, client: Any, service: Any, request: Rewrite = unchanged, response: Rewrite = unchanged
    ) -> None:
        def ask(query: zenoh.Query) -> None:
            """An undecodable request is logged and never answered, as with the real bridge."""
            future = client.call_async(deserialize_message(request(query.payload.to_bytes()), service.Request))
            future.add_done_callback(lambda done: reply(query, done.result()))

        def reply(query: zenoh.Query, answer: Any) -> None:
            query.reply(key, response(serialize_message(answer)))
            query.drop()

        self._kept.append(self._session.declare_queryable(key, ask))

    def _forward(self, key: str, kind: Any, topic: str, rewrite: Rewrite, *, latched: bool = False) -> None:
        if latched:
            last = ext.CacheConfig(max_samples=1)
            publisher = ext.declare_advanced_publisher(self._session, key, cache=last, publisher_detection=True)
        else:
            publisher = self._session.declare_publisher(key)
        heard = self.create_subscription(
            kind, topic, lambda payload: publisher.put(rewrite(payload)), LATCHED if latched else 10, raw=True
        )
        self._kept += [publisher, heard]

    def _token(self, path: str) -> None:
        self._kept.append(self._session.liveliness().declare_token(f"@/{self._session.zid()}/@ros2_lv{path}"))


def open_session(endpoint: str) -> zenoh.Session:
    config = zenoh.Config()
    values = {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "scouting/multicast/enabled": False,
        "timestamping/enabled": True,  # latched publishers need it
    }
    for key, value in values.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def main(endpoint: str) -> None:
    rclpy.init()
    executor = SingleThreadedExecutor()
    executor.add_node(Bridge(open_session(endpoint)))
    lifeline.ready()
    executor.spin()


if __name__ == "__main__":
    main(sys.argv[1])
