"""The shipped Foxglove layout shows what a recording holds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from drivers.topics import TOPICS

LAYOUT = json.loads((Path(__file__).resolve().parents[2] / "docs" / "foxglove_layout.json").read_text())


def leaves(node: Any) -> set[str]:
    return {node} if isinstance(node, str) else leaves(node["first"]) | leaves(node["second"])


def named(node: Any) -> set[str]:
    """Every ROS name in it; a plot's path goes on behind the name with a dot."""
    if isinstance(node, dict):
        return {key for key in node if key.startswith("/")} | {name for value in node.values() for name in named(value)}
    if isinstance(node, list):
        return {name for value in node for name in named(value)}
    return {node.partition(".")[0]} if isinstance(node, str) and node.startswith("/") else set()


def test_every_panel_is_placed_and_every_topic_is_one_that_is_recorded() -> None:
    assert leaves(LAYOUT["layout"]) == set(LAYOUT["configById"])
    assert {"/map", "/livox/lidar", "/livox/imu"} <= named(LAYOUT["configById"]) <= {topic.name for topic in TOPICS}
