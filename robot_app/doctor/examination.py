"""`openbelief doctor`: one table of checks, each a small function that says ok, warn or fail, and the remedy."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

from drivers.ports import LinkLost, PortError
from drivers.watchdog.heartbeat import WatchdogView
from robot_app.app import Robot, open_robot
from robot_app.config import Config, ConfigError, load_config
from robot_app.doctor.finding import Examined, Finding, Level
from robot_app.doctor.link import MEND
from robot_app.doctor.robot import ROBOT_CHECKS, port_topics
from robot_app.doctor.sensors import LISTEN_S, counter, examine_local
from robot_app.doctor.topic_probe import TopicProbe
from robot_app.doctor.workstation import WORKSTATION_CHECKS
from robot_app.record.recording import ON_THE_WIRE

NO_FILE = "name one with --config; openbelief demo writes demo-out/robot.toml, docs/robot.md has one for a robot"
LEFT_OUT = "then ask again, for transforms, map, Nav2 and watchdog were not looked at"


def examine_file(path: Path, now_ns: int) -> Iterator[Finding]:
    """Every check of what robot.toml names; without a usable one, those of this machine that need none."""
    try:
        config = load_config(path)
    except ConfigError as error:
        remedy = NO_FILE if not path.exists() else "mend that line; docs/robot.md has a whole file"
        yield Finding("config", Level.FAIL, str(error), remedy)
        yield from examine_workstation(Config(), now_ns)
        return
    yield Finding("config", Level.OK, str(path))
    yield from examine_workstation(config, now_ns)
    yield from examine_all_of_robot(config)


def examine_workstation(config: Config, now_ns: int) -> Iterator[Finding]:
    """The checks that need no robot."""
    for check in WORKSTATION_CHECKS:
        yield from check(config, now_ns)


def examine_all_of_robot(config: Config) -> Iterator[Finding]:
    """Where the robot cannot be opened, one line says why, and the sensors of this machine are looked at alone."""
    with ExitStack() as opened:
        try:
            robot = opened.enter_context(open_robot(config))
        except (PortError, OSError, ValueError, RuntimeError) as error:
            link = isinstance(error, LinkLost) and config.zenoh.endpoint in str(error)
            remedy = MEND["link"] if link else "mend that, or name another body for it in [ports]"
            yield Finding("robot", Level.FAIL, str(error), f"{remedy}; {LEFT_OUT}")
        else:
            yield from examine_robot(config, robot)
            return
    yield from examine_local(config)


def examine_robot(config: Config, robot: Robot) -> Iterator[Finding]:
    """The checks of an open robot, after a few seconds of listening."""
    ears = TopicProbe(robot.clock)
    for port in ("camera", "lidar", "pose"):
        word = getattr(config.ports, port)
        if word in ON_THE_WIRE:
            ears.hear(robot.wiring.wires[word], port_topics(port, config, robot))
    for port, sensor in (("camera", robot.camera), ("lidar", robot.lidar)):
        if counted := counter(sensor):
            ears.count(port, counted)
    if "ros" in (config.ports.camera, config.ports.lidar):
        ears.hear_diagnoses(robot.wiring.wires["ros"])
    wire = robot.wiring.wires[config.ports.navigator]
    watchdog = WatchdogView(wire.link, wire.keys)
    watchdog.start()
    ears.listen(LISTEN_S)
    patient = Examined(config, robot, ears, watchdog)
    for check in ROBOT_CHECKS:
        yield from check(patient)
