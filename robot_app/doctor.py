"""`openbelief doctor`: one table of checks, each a small function that says ok, warn or fail, and the remedy."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

from drivers.heartbeat import WatchdogView
from drivers.ports import PortError
from robot_app.app import Robot, open_robot
from robot_app.config import Config
from robot_app.doctor_ears import Ears
from robot_app.doctor_line import Level, Line, Patient
from robot_app.doctor_robot import ROBOT_CHECKS, port_topics
from robot_app.doctor_site import SITE_CHECKS
from robot_app.recording import ON_THE_WIRE

LISTEN_S = 3.0


def examine(config: Config, now_ns: int) -> Iterator[Line]:
    """Every check, those that need no robot first; where the robot cannot be opened, one line says why."""
    for check in SITE_CHECKS:
        yield from check(config, now_ns)
    with ExitStack() as opened:
        try:
            robot = opened.enter_context(open_robot(config))
        except (PortError, OSError, ValueError, RuntimeError) as error:
            yield Line("robot", Level.FAIL, str(error), "the checks of the robot were left out; mend this first")
            return
        yield from examine_robot(config, robot)


def examine_robot(config: Config, robot: Robot) -> Iterator[Line]:
    """The checks of an open robot, after a few seconds of listening."""
    ears = Ears(robot.clock)
    for port in ("camera", "lidar", "pose"):
        word = getattr(config.ports, port)
        if word in ON_THE_WIRE:
            ears.hear(robot.site.wires[word], port_topics(port, config, robot))
    wire = robot.site.wires[config.ports.navigator]
    watchdog = WatchdogView(wire.link, wire.keys)
    watchdog.start()
    ears.listen(LISTEN_S)
    patient = Patient(config, robot, ears, watchdog)
    for check in ROBOT_CHECKS:
        yield from check(patient)
