"""A mission among boxes: `stage`, what stands in it, and a recording of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from drivers.clock import SimClock
from drivers.ros.convert import grid_message, transforms_message
from drivers.ros.image_messages import camera_info_message, color_message, depth_message
from drivers.ros.messages import Message, encode
from logs.record.recorder import McapRecorder
from openbelief import g1
from support.boxes import CAMERA_FRAME, K, box, grid_of
from support.stage import Drive, Stage


@pytest.fixture(scope="session")
def stage() -> type[Stage]:
    return Stage


@pytest.fixture(scope="session")
def make() -> SimpleNamespace:
    """`make.box(...)`, `make.drive(...)`: words for the tests' scripts."""
    return SimpleNamespace(box=box, drive=Drive)


@pytest.fixture(scope="session")
def write_recording() -> Callable[..., Path]:
    """write_recording(path, stage, seconds): what a robot that stands still would record, at 5 Hz, /tf at 20 Hz."""

    def write(path: Path, stage: Stage, seconds: float) -> Path:
        clock = SimClock(1_700_000_000_000_000_000)
        mount = transforms_message(clock.now_ns(), [("base_link", CAMERA_FRAME, g1.T_BASE_CAMERA)])
        with McapRecorder(path, clock) as recorder:

            def put(topic: str, message: Message) -> None:
                recorder.write_cdr(topic, message.__msgtype__, clock.now_ns(), encode(message))

            put("/map", grid_message(grid_of(stage.boxes)))
            put("/tf_static", mount)
            for tick in range(round(seconds * 20)):
                now_ns = clock.now_ns()
                put("/tf", transforms_message(now_ns, [("map", "base_link", stage.robot.matrix())]))
                if tick % 4 == 0:
                    frame = stage.ports.camera.latest(1.0)
                    put("/camera/color/image_raw", color_message(now_ns, CAMERA_FRAME, frame.color))
                    put("/camera/depth/image_raw", depth_message(now_ns, CAMERA_FRAME, frame.depth_m))
                    put("/camera/color/camera_info", camera_info_message(now_ns, CAMERA_FRAME, K))
                clock.sleep(0.05)
        return path

    return write


@pytest.fixture
def extinguisher(make):
    return make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher")


@pytest.fixture
def impostor(make):
    """The same words on the map, a vase up close; mapped first, so that it is tried first."""
    return make.box(2.5, 5.0, "fire extinguisher", "blue vase")
