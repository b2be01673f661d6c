"""The robot's other programs come and go; `openbelief onboard` is not restarted. Real processes, in wall time."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from drivers.clock import SystemClock
from drivers.ports import StaleData
from drivers.ros.topics import RosCamera, RosLidar
from drivers.ros.zenoh_link import LinkConfig, ZenohLink
from drivers.watchdog.heartbeat import WatchdogView
from robot_app.benches.programs import Program
from support.waiting import until

PARTS = {  # what ends and comes back -> what onboard says of its lidar
    ("router",): "",
    ("lidar",): "it started anew 1 times",
    ("router", "lidar"): "it started anew 2 times",
}
FRESH_S = 2.0  # a loaded machine renders and sends late


class Robot:
    """A router, a MID-360 and onboard, each a process; a workstation that stays and looks at what onboard sends."""

    def __init__(self, opened: ExitStack, folder: Path) -> None:
        self._opened = opened
        network = f"127.{os.getpid() % 200 + 10}.{os.getpid() // 200 % 200}"
        self._addresses = ("--lidar-ip", f"{network}.121", "--host-ip", f"{network}.165")
        self._listen: tuple[str, ...] = ()
        self.router, self.endpoint = self._route()
        self._listen = ("--listen", self.endpoint)
        self.lidar = self._scan()
        config = folder / "robot.toml"
        config.write_text(
            f'[zenoh]\nendpoint = "{self.endpoint}"\n[onboard]\ncamera = "sim"\nlidar = "real"\ndds = "off"\n'
            f'[livox]\nlidar_ip = "{network}.121"\nhost_ip = "{network}.165"\n'
        )
        self.onboard = Program(opened, "robot_app.cli", "onboard", "--config", str(config))
        link, clock = opened.enter_context(ZenohLink(LinkConfig((self.endpoint,)))), SystemClock()
        self._ports = {"camera": RosCamera(link, clock), "lidar": RosLidar(link, clock)}
        self.watchdog = WatchdogView(link)
        for port in (*self._ports.values(), self.watchdog):
            port.start()

    def silent(self) -> set[str]:
        """What the workstation gets nothing fresh of."""
        return {name for name, port in self._ports.items() if not _fresh(port)} | self._unheard

    @property
    def _unheard(self) -> set[str]:
        return set() if self.watchdog.status else {"watchdog"}

    def again(self, *names: str) -> None:
        """Killed, noticed, and started anew."""
        for name in names:
            getattr(self, name).kill()
        gone = {"lidar"} if names == ("lidar",) else {"lidar", "camera", "watchdog"}
        until(lambda: gone <= self.silent(), f"without {names}, {gone} fall silent")
        if "router" in names:
            self.router, _ = self._route()
        if "lidar" in names:
            self.lidar = self._scan()

    def _route(self) -> tuple[Program, str]:
        made = Program(self._opened, "sim_fakes.wire.nav2_process", *self._listen)
        return made, made.expect("endpoint")["endpoint"]

    def _scan(self) -> Program:
        seconds = ("--seconds", "600")
        return Program(self._opened, "sim_fakes.sensors.livox_emulator", *seconds, *self._addresses)


def _fresh(port: RosCamera | RosLidar) -> bool:
    try:
        port.latest(FRESH_S)
    except StaleData:
        return False
    return True


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Robot]:
    with ExitStack() as opened:
        yield Robot(opened, tmp_path)


def test_clouds_images_and_the_watchdogs_word_come_again_after_the_robots_side_went_away(robot: Robot) -> None:
    until(lambda: not robot.silent(), "everything comes")
    for names, said in PARTS.items():
        robot.again(*names)
        begun_s = time.monotonic()
        until(lambda: not robot.silent(), f"everything comes again after {names}")
        print(f"again {time.monotonic() - begun_s:.1f} s after {' and '.join(names)}")
        until(lambda said=said: robot.onboard.heard(said), "the lidar's restart is told")
    assert not robot.onboard.ended and not robot.onboard.heard("its clock was set")
