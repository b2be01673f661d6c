"""robot.toml's camera = "real"."""

from __future__ import annotations

from contextlib import ExitStack

import pytest

from drivers.clock import SystemClock
from drivers.ports import PortError
from robot_app.app import BODIES
from robot_app.config import Config
from robot_app.simulation import START_NS, simulation
from robot_app.wiring import Wiring


def site(simulated=None) -> Wiring:
    config = Config.model_validate({"realsense": {"serial": "no such camera"}})
    return Wiring(SystemClock(), {}, None, simulated, lambda: b"", config, ExitStack())


def test_a_camera_that_is_not_there_is_named() -> None:
    with pytest.raises(PortError, match="No RealSense with serial number no such camera is connected"):
        BODIES["camera", "real"](site())


def test_a_real_camera_is_not_mixed_with_a_simulated_robot() -> None:
    simulated = simulation("flat", seed=1, start_ns=START_NS, camera_rate_hz=1.0)
    with pytest.raises(PortError, match="simulated robot's time"):
        BODIES["camera", "real"](site(simulated))
