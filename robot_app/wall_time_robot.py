"""The simulated robot of a configuration in a process of its own, in wall time: for whoever plays operator at a page.

A simulated clock passes only while the program sleeps, and a person waits in real seconds. So ports that say "sim"
become "ros" ports to a robot process at the other end of a real wire; nothing else changes.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from drivers.ports import PortError
from drivers.processes import end_or_kill
from robot_app.config import Config

END_S = 10.0
# A rendered image takes 0.2 s of a core that others use too: it may be older than a camera's.
SLOW_MISSION: dict[str, Any] = {"camera_max_age_s": 2.0, "cloud_max_age_s": 2.0, "pose_max_age_s": 1.0}
SLOW_SAFETY: dict[str, Any] = {"camera_max_age_s": 6.0, "cloud_max_age_s": 3.0, "pose_max_age_s": 1.0}


@contextmanager
def in_wall_time(config: Config) -> Iterator[Config]:
    """The configuration to open; a simulated robot runs until the end of the block. Raises PortError."""
    if not config.ports.uses("sim"):
        yield config
        return
    command = [sys.executable, "-m", "sim_fakes.wire.robot_process", "--scene", config.sim.scene]
    command += ["--seed", str(config.sim.seed), "--lidar", "topic"]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        yield _reached(config, _endpoint(process))
    finally:
        assert process.stdin is not None and process.stdout is not None
        process.stdin.close()  # the end of its input ends it
        end_or_kill(process, END_S)
        process.stdout.close()


def _endpoint(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line:
        raise PortError("The simulated robot did not start; what it said is above.")
    return str(json.loads(line)["endpoint"])


def _reached(config: Config, endpoint: str) -> Config:
    """Without what only a real robot has: a watchdog, and a bridge that hides nothing."""
    bodies = {port: "ros" if body == "sim" else body for port, body in config.ports.model_dump().items()}
    profile = config.perception.profile
    scripted = f"scripted:{config.sim.scene}" if profile == "scripted" else profile
    return config.model_copy(
        update={
            "ports": type(config.ports).model_validate({**bodies, "battery": "ros"}),
            "zenoh": config.zenoh.model_copy(update={"endpoint": endpoint, "namespace": ""}),
            "safety": replace(config.safety, watchdog="off", **SLOW_SAFETY),
            "mission": replace(config.mission, **SLOW_MISSION),
            "perception": config.perception.model_copy(update={"profile": scripted}),
        }
    )
