"""The Zenoh configurations of a network: who may connect, who may do what, how large, how soon a silent end is noticed.

What is not allowed here is denied. Access goes by the certificate's common name; the robot's own processes connect over
its loopback, unencrypted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from drivers.ros.bridge_keys import BridgeKeys, bridge_version_key
from drivers.topics import (
    ACTION_MAX_BYTES,
    COMPUTE_PATH_TO_POSE,
    IS_ACTIVE,
    MAX_BYTES,
    NAVIGATE_TO_POSE,
    TOPICS,
)
from drivers.watchdog.wire import MAX_BYTES as WATCHDOG_MAX_BYTES
from drivers.watchdog.wire import WatchdogKeys
from robot_app.remote.messages import AGENT_MAY, LOOKS, REQUEST_MAX_BYTES, VERBS, operator_key

ROBOT, WORKSTATION, VIEWER, CONSOLE = "robot", "workstation", "viewer", "console"
OPERATOR, AGENT = "operator", "agent"  # other programs: a person's, and a language model's
LEASE_MS = 2000  # how soon the robot notices that a link fell silent
LOOPBACK = "127.0.0.1"
MAX_SESSIONS = 16  # of the robot's own processes and the operator's; viewers have a door of their own
VIEWERS_MAX = 12  # and one more: that door's own link to the robot
VIEWERS = "viewers"
ACTIONS = (NAVIGATE_TO_POSE, COMPUTE_PATH_TO_POSE)
READS = ["declare_subscriber", "declare_liveliness_subscriber", "liveliness_query", "query"]
HEARS = ["put", "delete", "reply", "liveliness_token"]
EVERYTHING = [*READS, *HEARS, "declare_queryable"]
# ** leaves out what begins with @: tokens, latched topics' pasts, the bridge's version
EVERYWHERE = [
    "**",
    "@/*/@ros2_lv/**",
    "**/@adv/**",
    bridge_version_key(),
]


SUBJECTS: list[dict[str, Any]] = [
    {"id": "the robot itself", "interfaces": ["lo"], "link_protocols": ["tcp"]},
    {"id": ROBOT, "cert_common_names": [ROBOT]},
    {"id": WORKSTATION, "cert_common_names": [WORKSTATION]},
    {"id": VIEWER, "cert_common_names": [VIEWER]},
    {"id": OPERATOR, "cert_common_names": [OPERATOR]},
    {"id": AGENT, "cert_common_names": [AGENT]},
]
# rules by name -> who may
POLICIES: list[dict[str, list[str]]] = [
    {"rules": ["all"], "subjects": ["the robot itself", ROBOT]},
    {
        "rules": ["hear", "listen", "ask for the past", "ask whether Nav2 is up"],
        "subjects": [WORKSTATION, VIEWER],
    },
    {
        "rules": ["be told of", "command", "live", "be alive", "serve the operator", "be asked"],
        "subjects": [WORKSTATION],
    },
    {"rules": ["hear", "be told of"], "subjects": [OPERATOR, AGENT]},
    {"rules": ["look and stop"], "subjects": [VIEWER]},
    {"rules": ["propose"], "subjects": [AGENT]},
    {"rules": ["ask and confirm"], "subjects": [OPERATOR, WORKSTATION]},
]


@dataclass(frozen=True)
class ZenohNetwork:
    """robot: the robot's address, and `port` on it. folder: where the robot's files lie on the robot."""

    robot: str
    port: int = 7447
    namespace: str = ""
    folder: str = "/etc/openbelief"

    @property
    def endpoint(self) -> str:
        return f"tls/{self.robot}:{self.port}"

    @property
    def local_endpoint(self) -> str:
        return f"tcp/{LOOPBACK}:{self.port if self.robot != LOOPBACK else self.port + 1}"

    @property
    def keys(self) -> BridgeKeys:
        return BridgeKeys(self.namespace)

    @property
    def viewers_endpoint(self) -> str:
        """A door with certificates of its own: who may only look cannot take the operator's places, nor the robot's."""
        return f"tls/{self.robot}:{self.port + 2}"

    def router(self) -> dict[str, Any]:
        """For zenohd on the robot; bridge and onboard process connect to it over the loopback."""
        return self._door([self.endpoint, self.local_endpoint], "ca", ROBOT, MAX_SESSIONS)

    def viewers(self) -> dict[str, Any]:
        """For a zenohd of its own on the robot: viewers connect there, and it connects over the loopback."""
        door = self._door([self.viewers_endpoint], "viewers-ca", VIEWERS, VIEWERS_MAX + 1)
        return {**door, "connect": {"endpoints": [self.local_endpoint]}}

    def _door(self, endpoints: list[str], authority: str, name: str, sessions: int) -> dict[str, Any]:
        return {
            "mode": "router",
            "listen": {"endpoints": endpoints},
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
            "transport": {
                "unicast": {"max_sessions": sessions},
                "link": {
                    "tx": {"lease": LEASE_MS},
                    "rx": {"max_message_size": MAX_BYTES + (64 << 10)},
                    "tls": {
                        "root_ca_certificate": f"{self.folder}/{authority}.pem",
                        "listen_certificate": f"{self.folder}/{name}.pem",
                        "listen_private_key": f"{self.folder}/{name}.key",
                        "enable_mtls": True,
                        "close_link_on_expiration": True,
                    },
                },
            },
            "access_control": self.access_control(),
            "low_pass_filter": self.size_limits(),
        }

    def bridge(self) -> dict[str, Any]:
        """For zenoh-bridge-ros2dds as the router itself: the same doors, and only the ROS names that are used."""
        return {**self.router(), "plugins": {"ros2dds": self.ros2dds()}}

    def ros2dds(self) -> dict[str, Any]:
        return {
            "namespace": f"/{self.namespace.strip('/')}",
            "ros_localhost_only": True,
            "allow": {
                "publishers": [f"^{topic.name}$" for topic in TOPICS],
                "subscribers": [],
                "service_servers": [f"^{IS_ACTIVE.name}$"],
                "service_clients": [],
                "action_servers": [f"^{action.name}$" for action in ACTIONS],
                "action_clients": [],
            },
            "pub_max_frequencies": [f"^{topic.name}$={topic.rate_hz:g}" for topic in TOPICS if topic.rate_hz],
        }

    def access_control(self) -> dict[str, Any]:
        """Default deny. Who may command is the workstation alone; a viewer sees what the robot tells and no more."""
        return {
            "enabled": True,
            "default_permission": "deny",
            "rules": self._rules(),
            "subjects": SUBJECTS,
            "policies": POLICIES,
        }

    def _rules(self) -> list[dict[str, Any]]:
        return [
            _rule("all", EVERYTHING, ["ingress", "egress"], EVERYWHERE),
            _rule("hear", HEARS, ["egress"], EVERYWHERE),
            _rule("be told of", ["declare_subscriber", "declare_queryable"], ["egress"], EVERYWHERE),
            _rule("listen", READS[:3], ["ingress"], EVERYWHERE),
            _rule("ask for the past", ["query"], ["ingress"], ["**/@adv/**"]),
            _rule(
                "ask whether Nav2 is up",
                ["query"],
                ["ingress"],
                [self.keys.service(IS_ACTIVE), bridge_version_key()],
            ),
            _rule("command", ["query"], ["ingress"], self.command_keys()),
            _rule("serve the operator", ["declare_queryable", "reply"], ["ingress"], self.operator_keys(VERBS)),
            _rule("be asked", ["query"], ["egress"], self.operator_keys(VERBS)),
            _rule("look and stop", ["query"], ["ingress"], self.operator_keys(LOOKS)),
            _rule("propose", ["query"], ["ingress"], self.operator_keys(AGENT_MAY)),
            _rule("ask and confirm", ["query"], ["ingress"], self.operator_keys(VERBS)),
            _rule("live", ["put", "delete"], ["ingress"], [WatchdogKeys(self.keys).heartbeat]),
            _rule("be alive", ["liveliness_token"], ["ingress"], [WatchdogKeys(self.keys).token()]),
        ]

    def command_keys(self) -> list[str]:
        """What moves the robot or stops it: goals, results, cancels, and the watchdog's reset."""
        return [self.keys.action(action, "*") for action in ACTIONS] + [WatchdogKeys(self.keys).reset]

    def operator_keys(self, verbs: Sequence[str]) -> list[str]:
        """What a run with [remote] serve = "robot" answers (docs/api.md)."""
        return [operator_key(verb, self.namespace) for verb in verbs]

    def size_limits(self) -> list[dict[str, Any]]:
        """What comes in from outside is small: heartbeats and commands."""
        watchdog = WatchdogKeys(self.keys)
        return [
            _limit("heartbeats", ["put"], [watchdog.heartbeat], WATCHDOG_MAX_BYTES),
            _limit("commands", ["query"], self.command_keys(), COMMAND_MAX_BYTES),
            _limit("requests", ["query"], self.operator_keys(VERBS), REQUEST_MAX_BYTES),
            _limit("answers", ["reply"], self.command_keys(), ACTION_MAX_BYTES),
        ]


COMMAND_MAX_BYTES = 16 << 10


def _rule(name: str, messages: list[str], flows: list[str], keys: list[str]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "messages": messages, "flows": flows, "key_exprs": keys}


def _limit(name: str, messages: list[str], keys: list[str], size: int) -> dict[str, Any]:
    return {"id": name, "messages": messages, "flows": ["ingress"], "key_exprs": keys, "size_limit": size}
