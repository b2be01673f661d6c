"""What watches over live missions: the supervisor with its sources, and the heartbeat for the robot's watchdog."""

from __future__ import annotations

import shutil
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from behaviors.supervision import Sources, Supervision, nothing_wrong
from drivers.ports import Navigator, Safety
from drivers.ros.zenoh_link import ZenohLink
from drivers.watchdog.drive_liveness import DriveLiveness
from drivers.watchdog.heartbeat import Heartbeat, WatchdogView
from openbelief.memory import ObjectMemory
from robot_app.app import Robot
from robot_app.config import Config

ARMED_S = 2.0
FIRST_DATA_S = 5.0  # a battery's state comes once a second or less
LOOK_S = 0.05
ARRIVING = {"pose", "camera", "cloud", "battery unknown"}  # conditions that the first message mends


@dataclass(frozen=True)
class Watch:
    """navigator: the robot's, whose goals keep the heart beating only while they are watched. watchdog: the robot's, as
    it is heard here; a simulated robot has none. trouble: what is wrong with link or watchdog, for a screen."""

    safety: Safety
    navigator: Navigator
    heartbeat: Heartbeat
    watchdog: WatchdogView
    trouble: Callable[[], str | None] = nothing_wrong


@contextmanager
def watched(config: Config, robot: Robot, memory: ObjectMemory) -> Iterator[Watch]:
    """Beats as long as missions may run; the supervisor is asked by them, once what it judges by has arrived."""
    wire = robot.wiring.wires[config.ports.navigator]
    workstation = uuid.uuid4().hex
    watchdog = WatchdogView(wire.link, wire.keys, workstation=workstation)
    watchdog.start()
    needed = config.ports.navigator == "ros" and config.safety.watchdog == "required"
    sources = Sources(
        clock=robot.clock,
        poses=robot.poses,
        map=robot.map,
        camera=robot.camera,
        lidar=robot.lidar if config.safety.lidar == "used" else None,
        battery=robot.battery,
        disk_free_bytes=lambda: _writable_bytes(config.trials),
        link=_link_trouble(wire.link),
        watchdog=watchdog.trouble if needed else nothing_wrong,
        memory=memory,
    )
    pulse = DriveLiveness(robot.navigator)
    with Heartbeat(wire.link, wire.keys, workstation=workstation, alive=pulse.beats) as heartbeat:
        if needed:
            _await_armed(watchdog)
        safety = Supervision(sources, config.safety)
        _await_first_data(robot, safety)
        yield Watch(safety, pulse, heartbeat, watchdog, lambda: sources.link() or sources.watchdog())


def _await_armed(watchdog: WatchdogView) -> None:
    """Give the first beat and the watchdog's word on it a moment; what is wrong then, the supervisor says."""
    end_s = time.monotonic() + ARMED_S
    while watchdog.trouble() and time.monotonic() < end_s:
        time.sleep(LOOK_S)


def _await_first_data(robot: Robot, safety: Safety) -> None:
    """Give Nav2's signs and each sensor's first message a moment; what is missing then, the mission says."""
    give_up_s = time.monotonic() + FIRST_DATA_S  # asking Nav2 takes wall time, whatever clock the robot has
    for _ in range(round(FIRST_DATA_S / LOOK_S)):
        if safety.verdict(None).condition not in ARRIVING and robot.navigator.unavailable() is None:
            return
        if time.monotonic() > give_up_s:
            return
        robot.clock.sleep(LOOK_S)


def _writable_bytes(folder: Path) -> int:
    """0 where the folder cannot be reached (a disk that was pulled out): nothing can be written there."""
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return 0


def _link_trouble(link: ZenohLink) -> Callable[[], str | None]:
    where = ", ".join(link.config.endpoints)
    return lambda: None if link.alive else f"The link to the robot ({where}) is down."
