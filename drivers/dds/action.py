"""A ROS 2 action on DDS as CycloneDDS names it: its topics, its types, and the header of a request."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.topics import Action

CANCEL_REQUEST, CANCEL_RESPONSE = "action_msgs/srv/CancelGoal_Request", "action_msgs/srv/CancelGoal_Response"
STATUS_ARRAY = "action_msgs/msg/GoalStatusArray"
HEADER = struct.Struct("<Qq")  # client id and sequence number, given back with the reply as they came
ENCAPSULATION = 4


@dataclass(frozen=True)
class ActionTopics:
    """Names as ROS has them; a namespace of the bridge is Zenoh's alone."""

    action: Action

    @property
    def _name(self) -> str:
        return self.action.name.strip("/")

    @property
    def cancel_request(self) -> str:
        return f"rq/{self._name}/_action/cancel_goalRequest"

    @property
    def cancel_reply(self) -> str:
        return f"rr/{self._name}/_action/cancel_goalReply"

    @property
    def status(self) -> str:
        return f"rt/{self._name}/_action/status"


def with_header(payload: bytes, client: int, sequence: int) -> bytes:
    """A request or reply as it stands on the wire."""
    return payload[:ENCAPSULATION] + HEADER.pack(client, sequence) + payload[ENCAPSULATION:]


def without_header(payload: bytes) -> tuple[bytes, int, int] | None:
    """(payload, client, sequence), None where there is no header."""
    if len(payload) < ENCAPSULATION + HEADER.size:
        return None
    client, sequence = HEADER.unpack_from(payload, ENCAPSULATION)
    return payload[:ENCAPSULATION] + payload[ENCAPSULATION + HEADER.size :], client, sequence
