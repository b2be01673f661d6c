"""Zenoh keys of ROS names: what a bridge must say, and how zenoh-bridge-ros2dds says it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from drivers.topics import Action, Service, Topic


def bridge_version_key(zid: str = "*") -> str:
    """Where zenoh-bridge-ros2dds says its version, in Zenoh's admin space; zid "*" for any."""
    return (
        f"@/{zid}/*/status/plugins/ros2dds/__version__"
        if zid == "*"
        else (f"@/{zid}/router/status/plugins/ros2dds/__version__")
    )


class Keys(Protocol):
    """Every key that the drivers use. Another way for ROS to cross Zenoh (rmw_zenoh) is another such class."""

    def topic(self, topic: Topic) -> str:
        """Samples of a topic."""
        ...

    def service(self, service: Service) -> str:
        """Queries to a service."""
        ...

    def action(self, action: Action, part: str) -> str:
        """part: send_goal, get_result, cancel_goal (queries), feedback, status (samples)."""
        ...

    def bridge_token(self, zid: str) -> str:
        """Liveliness token of what stands between ROS and Zenoh; zid "*" for any."""
        ...

    def action_token(self, action: Action, zid: str = "*") -> str:
        """Liveliness token of an action server."""
        ...


@dataclass(frozen=True)
class BridgeKeys:
    """namespace: the bridge's own, "" or like "/g1"; every key is then below it, /tf too."""

    namespace: str = ""

    def topic(self, topic: Topic) -> str:
        return self.name(topic.name)

    def service(self, service: Service) -> str:
        return self.name(service.name)

    def action(self, action: Action, part: str) -> str:
        """part: send_goal, get_result, cancel_goal (queries), feedback, status (samples)."""
        return f"{self.name(action.name)}/_action/{part}"

    def name(self, ros_name: str) -> str:
        """A ROS name without its leading slash, below the namespace."""
        return f"{self.namespace}/{ros_name}".replace("//", "/").strip("/")

    def tokens(self, zid: str = "*") -> str:
        """Key expression of every liveliness token of the bridge."""
        return f"@/{zid}/@ros2_lv/**"

    def bridge_token(self, zid: str) -> str:
        """The bridge itself."""
        return f"@/{zid}/@ros2_lv"

    def action_token(self, action: Action, zid: str = "*") -> str:
        """An action server behind the bridge."""
        key, kind = self.name(action.name).replace("/", "§"), action.type_name.replace("/", "§")
        return f"@/{zid}/@ros2_lv/AS/{key}/{kind}"
