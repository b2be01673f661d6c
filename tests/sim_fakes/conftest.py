"""A scene small enough for any test: one room, a wall with a door, and three things of which one is misnamed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from sim_fakes.world.world import World
from support.encoders import WordEncoder


@pytest.fixture
def small_scene() -> dict[str, Any]:
    """The JSON of the scene; tests may change their copy."""
    return {
        "format": "openbelief.scene/1",
        "name": "small",
        "start": [1.0, 1.5, 0],
        "walk": [[1.0, 1.5, 0], [1.2, 1.5, 45]],
        "rooms": [
            {"name": "lab", "polygon": [[0, 0], [4, 0], [4, 3], [0, 3]], "floor": "tiles"},
            {"name": "store", "polygon": [[4, 0], [6, 0], [6, 3], [4, 3]]},
        ],
        "doors": [{"at": [4, 1.5], "width": 1.0}],
        "vocabulary": {"box": {"names_near": {"carton": 1.0}}},
        "objects": [
            {"id": 100, "label": "vase", "shape": "cylinder", "position": [2.4, 1.2], "size": [0.3, 0.3, 0.5],
             "colour": "red", "names_far": {"red vase": 1.0}, "confusion": {"phrase": "hydrant", "rate": 0.7}},
            {"id": 101, "label": "box", "shape": "box", "position": [2.2, 2.1], "yaw_deg": 30, "size": [0.4, 0.3, 0.3],
             "colour": "wood"},
            {"id": 102, "label": "cabinet", "shape": "cabinet", "position": [3.6, 0.3], "size": [0.6, 0.4, 1.9],
             "colour": "white"},
        ],
        "queries": [{"query": "vase", "kind": "direct", "accept": [100]}],
    }  # fmt: skip


@pytest.fixture
def small_world(small_scene: dict[str, Any], tmp_path: Path) -> World:
    path = tmp_path / "small.json"
    path.write_text(json.dumps(small_scene))
    return World.load(path)


@pytest.fixture
def encoder() -> WordEncoder:
    return WordEncoder(64)
