"""What a channel of ours declares: ROS 2 message text, JSON Schema, and the QoS that `ros2 bag play` offers."""

from __future__ import annotations

import json
from functools import cache
from typing import TYPE_CHECKING

from drivers.ros.messages import codec
from logs.mcap_io.file import ChannelSpec

if TYPE_CHECKING:
    from pydantic import BaseModel

FOREVER = {"sec": 9223372036, "nsec": 854775807}  # rmw's "no limit", as rosbag2 writes it
RELIABLE, VOLATILE, TRANSIENT_LOCAL, KEEP_LAST, AUTOMATIC = 1, 2, 1, 1, 1


@cache
def cdr_channel(topic: str, type_name: str, *, latched: bool) -> ChannelSpec:
    """A channel of CDR messages, e.g. `sensor_msgs/msg/Image`; an unknown type is a drivers.ros.messages.WireError."""
    qos = {"offered_qos_profiles": qos_text(latched=latched)}
    return ChannelSpec(topic, "cdr", type_name, "ros2msg", codec().definition(type_name).encode(), qos)


@cache
def json_channel(topic: str, model: type[BaseModel]) -> ChannelSpec:
    """A channel of JSON records; the schema's name is `openbelief/Model`."""
    schema = json.dumps(model.model_json_schema(mode="serialization"), sort_keys=True).encode()
    return ChannelSpec(topic, "json", f"openbelief/{model.__name__}", "jsonschema", schema)


def qos_text(*, latched: bool) -> str:
    """One offered profile in rosbag2's YAML; a latched topic is kept for late subscribers when played back."""
    lines = [
        f"- history: {KEEP_LAST}",
        f"  depth: {1 if latched else 10}",
        f"  reliability: {RELIABLE}",
        f"  durability: {TRANSIENT_LOCAL if latched else VOLATILE}",
        *_duration("deadline"),
        *_duration("lifespan"),
        f"  liveliness: {AUTOMATIC}",
        *_duration("liveliness_lease_duration"),
        "  avoid_ros_namespace_conventions: false",
    ]
    return "\n".join(lines)


def _duration(name: str) -> list[str]:
    return [f"  {name}:", *(f"    {unit}: {value}" for unit, value in FOREVER.items())]
