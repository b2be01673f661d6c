"""A session in the field, rehearsed: robot, onboard process and workstation as processes of their own, in wall time."""

from __future__ import annotations

import json
import os
import queue
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from drivers.ros.zenoh_link import LinkConfig, ZenohLink
from drivers.watchdog.heartbeat import WatchdogView
from drivers.watchdog.latch import WatchdogState
from logs.mcap_io.reader import LogReader
from openbelief import ObjectMemory
from robot_app.cli import main
from sim_fakes.world.world import World
from support.waiting import until

SMALL = Path(__file__).parents[1] / "small_scene.json"
PATIENCE_S = 90.0  # for one step, on a machine that does other work too
QUERY = "go to the armchair"
SOME = r"(?!0\.0)[0-9.]+/s"  # a rate that is not zero


class Program:
    """A process of ours, its standard input, and the lines it has printed; killed at the end, whatever happens."""

    def __init__(self, opened: ExitStack, *command: str) -> None:
        self.name = " ".join(command[:3])
        self._lines: queue.Queue[str] = queue.Queue()
        self.said: list[str] = []
        self._process = subprocess.Popen(
            [sys.executable, "-m", *command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        opened.callback(self._end)
        threading.Thread(target=self._read, daemon=True).start()

    def expect(self, pattern: str) -> str:
        """The next line in which the regular expression is found."""
        end_s = time.monotonic() + PATIENCE_S
        while (left_s := end_s - time.monotonic()) > 0:
            try:
                line = self._lines.get(timeout=min(left_s, 0.5))
            except queue.Empty:
                if self._process.poll() is not None:
                    break
                continue
            if re.search(pattern, line):
                return line
        raise AssertionError(f"{self.name} did not say {pattern!r}; it said: {''.join(self.said[-12:])}")

    def tell(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()

    def hang_up(self) -> int:
        """The end of its input, and the exit status."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        return self.end()

    def interrupt(self) -> int:
        """Ctrl-C, and the exit status."""
        self._process.send_signal(signal.SIGINT)
        return self.end()

    def end(self) -> int:
        return self._process.wait(PATIENCE_S)

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.said.append(line)
            self._lines.put(line)

    def _end(self) -> None:
        self._process.kill()
        self._process.wait()


class Watchdog:
    """Every state of the robot's watchdog that was heard."""

    def __init__(self, opened: ExitStack, endpoint: str) -> None:
        self._view = WatchdogView(opened.enter_context(ZenohLink(LinkConfig((endpoint,)))))
        self._view.start()
        self.heard: list[WatchdogState] = []
        self._stop = threading.Event()
        listening = threading.Thread(target=self._listen)
        listening.start()
        opened.callback(listening.join)
        opened.callback(self._stop.set)

    @property
    def state(self) -> WatchdogState | None:
        return self._view.status.state if self._view.status else None

    def _listen(self) -> None:
        while not self._stop.wait(0.05):
            state = self.state
            if state is not None and self.heard[-1:] != [state]:
                self.heard.append(state)


@pytest.fixture
def opened() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def addresses() -> tuple[str, str]:
    """A lidar and a host of this test alone: all of 127/8 is this machine, and the lidar's ports are the factory's."""
    network = f"127.{os.getpid() % 200 + 10}.{os.getpid() // 200 % 200}"
    return f"{network}.120", f"{network}.164"


def write_config(folder: Path, endpoint: str, lidar_ip: str, host_ip: str) -> Path:
    """One robot.toml for both machines. Limits are wide: the session is judged here, not this machine's load."""
    bodies = "".join(f'{port} = "ros"\n' for port in ("camera", "lidar", "pose", "map", "navigator", "battery"))
    path = folder / "robot.toml"
    path.write_text(
        f'memory = "site.belief"\n[ports]\n{bodies}[zenoh]\nendpoint = "{endpoint}"\n'
        f'[livox]\nlidar_ip = "{lidar_ip}"\nhost_ip = "{host_ip}"\n[onboard]\nlidar = "real"\nlidar_rate_hz = 5.0\n'
        f'[perception]\nprofile = "scripted:{SMALL}"\n'
        "[mission]\ncamera_max_age_s = 4.0\npose_max_age_s = 2.0\ncloud_max_age_s = 4.0\n"
        "[safety]\ndisk_min_bytes = 1000000\npose_max_age_s = 2.0\ncloud_max_age_s = 4.0\ncamera_max_age_s = 10.0\n"
        "[recording]\nwarn_bytes = 1000000\nstop_bytes = 1000000\n"
    )
    return path


def test_a_walk_is_recorded_mapped_and_driven_from_in_separate_processes(tmp_path, opened, capsys):
    lidar_ip, host_ip = addresses()
    lidar = ["--lidar-ip", lidar_ip, "--host-ip", host_ip]
    robot = Program(opened, "sim_fakes.wire.robot_process", "--scene", str(SMALL), *lidar)
    endpoint = json.loads(robot.expect("endpoint"))["endpoint"]
    config = str(write_config(tmp_path, endpoint, lidar_ip, host_ip))
    onboard = Program(opened, "robot_app.cli", "onboard", "--config", config)
    onboard.expect("The watchdog watches")
    watchdog = Watchdog(opened, endpoint)
    until(lambda: watchdog.state is WatchdogState.WAITING, "the watchdog waits for a workstation")

    walk = tmp_path / "walk.mcap"
    record = Program(opened, "robot_app.cli", "record", "-o", str(walk), "--config", config)
    record.expect(f"depth {SOME}.*livox/lidar {SOME}")  # the lidar by UDP to onboard, and by Zenoh from there
    for _ in range(2):  # a loaded machine renders few images of one walk
        robot.tell("walk")
        robot.expect("ended")
    assert record.interrupt() == 0, record.said
    assert len(list(LogReader(walk).messages({"/livox/imu"}))) > 200, "its IMU comes the same way"

    memory = tmp_path / "site.belief"
    mapping = ["--perception", f"scripted:{SMALL}", "--stride", "2"]
    assert main(["map", str(walk), "-o", str(memory), *mapping, "--json"]) == 0
    mapped = json.loads(capsys.readouterr().out)
    assert mapped["frames"] >= 4 and mapped["objects"] >= 2

    def levels() -> dict[str, str]:
        main(["doctor", "--config", config, "--json"])
        return {line["name"]: line["level"] for line in json.loads(capsys.readouterr().out)["checks"]}

    def failing() -> set[str]:
        return {name for name, level in levels().items() if level == "fail"}

    # the simulated robot's Nav2 stands behind Zenoh alone: no second way to it, and the doctor says so
    until(lambda: failing() == {"watchdog without bridge"}, "the doctor finds nothing else that fails")
    found = levels()
    needed = ("link", "lidar", "camera", "tf map -> base_link", "map", "nav2 active", "watchdog", "battery")
    assert {name: found[name] for name in needed} == dict.fromkeys(needed, "ok")

    trial = tmp_path / "trial.mcap"
    ask = Program(opened, "robot_app.cli", "ask", QUERY, "--yes", "--config", config, "--trial", str(trial), "--json")
    outcome = json.loads(ask.expect('"outcome"'))
    assert (outcome["outcome"], outcome["trial_failure"]) == ("CONFIRMED", None), ask.said
    assert ask.end() == 0
    assert near_an_armchair(memory, outcome["object_id"])
    until(lambda: watchdog.state is WatchdogState.WAITING, "the workstation has said goodbye")
    assert watchdog.heard == [
        WatchdogState.WAITING,
        WatchdogState.ARMED,
        WatchdogState.WAITING,
    ]  # it watched the drive, and did not trip

    assert main(["replay", str(trial), "--json"]) == 0
    assert (onboard.interrupt(), robot.hang_up()) == (0, 0)


def near_an_armchair(memory: Path, object_id: int) -> bool:
    chair = next(thing for thing in World.load(SMALL).objects if thing.label == "armchair")
    centroid = ObjectMemory.open(memory).objects[object_id].centroid
    return bool(((centroid >= chair.aabb[0] - 0.25) & (centroid <= chair.aabb[1] + 0.25)).all())
