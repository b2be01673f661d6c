"""The watchdog with real processes: how long after a workstation is lost does the cancel reach Nav2?

Three losses, each --runs times: the workstation killed (SIGKILL), stopped (SIGSTOP), and its link cut (a relay that
stops forwarding and closes nothing). Workstation, `openbelief onboard`, and the simulated bridge with Nav2 are
processes of their own on loopback. Fails where the worst time is above 1 s.
"""

from __future__ import annotations

import argparse
import json
import os
import queue
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from drivers.watchdog.heartbeat import WatchdogView
    from sim_fakes.wire.silent_wire import SilentWire

PROMISE_S = 1.0
START_S, LATE_S = 20.0, 5.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--runs", type=_runs, default=20, help="of each loss (default 20)")
    parser.add_argument(
        "--sensors", action="store_true", help="onboard publishes an emulated camera and lidar meanwhile"
    )


def run(options: argparse.Namespace) -> None:
    with site(sensors=options.sensors) as bench:
        result = {loss: bench.measure(loss, options.runs) for loss in LOSSES}
    if options.json:
        print_json(result)
    else:
        print(_table(result))
    worst_s = max(times["worst_s"] for times in result.values())
    if worst_s > PROMISE_S:
        raise Failure(f"the worst time is {worst_s:.2f} s, more than {PROMISE_S:g} s: the robot would be told too late")


class Program:
    """A Python module as a process of its own; `expect` waits for its next JSON line with that key."""

    def __init__(self, opened: ExitStack, module: str, *arguments: str) -> None:
        self._name = module
        command = [sys.executable, "-m", module, *arguments]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self._lines: queue.Queue[dict[str, Any]] = queue.Queue()
        self._complaints: list[str] = []
        self.pid = self._process.pid
        threading.Thread(target=self._read, daemon=True).start()
        threading.Thread(target=self._complain, daemon=True).start()
        opened.callback(self.kill)

    def expect(self, key: str, timeout_s: float) -> dict[str, Any]:
        end_s = time.monotonic() + timeout_s
        while (left_s := end_s - time.monotonic()) > 0:
            try:
                line = self._lines.get(timeout=left_s)
            except queue.Empty:
                break
            if key in line:
                return line
        said = self._complaints[-1] if self._complaints else "it said nothing"
        raise Failure(f"{self._name} did not report {key!r} within {timeout_s:g} s ({said})")

    def forget(self) -> None:
        """What it said so far."""
        while not self._lines.empty():
            self._lines.get_nowait()

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(json.loads(line))

    def _complain(self) -> None:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            self._complaints = [*self._complaints[-20:], line.strip()]


class Bench:
    """nav2, onboard and the wire stand through all runs; each run has a new workstation."""

    def __init__(self, nav2: Program, wire: SilentWire, view: WatchdogView) -> None:
        self._nav2, self._wire, self._view = nav2, wire, view

    def measure(self, loss: str, runs: int) -> dict[str, Any]:
        times = [self._once(loss, number) for number in range(runs)]
        return {
            "runs": runs,
            "median_s": round(statistics.median(times), 3),
            "worst_s": round(max(times), 3),
            "times_s": [round(seconds, 4) for seconds in times],
        }

    def _once(self, loss: str, number: int) -> float:
        """Seconds from the loss to the cancel at Nav2, with the heartbeat at another phase each time."""
        with ExitStack() as opened:
            workstation = Program(opened, "sim_fakes.wire.workstation_process", self._wire.endpoint)
            if not workstation.expect("driving", START_S)["driving"]:
                raise Failure("the simulated Nav2 did not take the goal")
            self._until("armed", lambda: self._state() == "armed")
            time.sleep(0.3 + 0.1 * (number * 0.618 % 1.0))
            self._nav2.forget()
            lost_ns = time.monotonic_ns()
            LOSSES[loss](workstation, self._wire)
            cancel = self._nav2.expect("cancel_ns", LATE_S)
        if not cancel["all"] or cancel["cancel_ns"] < lost_ns:
            raise Failure(f"a cancel came that is not the watchdog's: {cancel}")
        self._wire.mend()
        self._until("latched", lambda: self._state() == "latched")
        self._until("reset", lambda: self._view.reset().ok)
        self._until("waiting", lambda: self._state() == "waiting")
        return (cancel["cancel_ns"] - lost_ns) / 1e9

    def _state(self) -> str:
        return self._view.status.state if self._view.status else "silent"

    def _until(self, what: str, condition: Callable[[], bool]) -> None:
        end_s = time.monotonic() + LATE_S
        while not condition():
            if time.monotonic() > end_s:
                raise Failure(f"the watchdog is {self._state()}, not {what}, after {LATE_S:g} s")
            time.sleep(0.02)


@contextmanager
def site(*, sensors: bool = False) -> Iterator[Bench]:
    """The robot's processes, started and heard."""
    from drivers.ros.zenoh_link import LinkConfig, ZenohLink
    from drivers.watchdog.heartbeat import WatchdogView
    from sim_fakes.wire.silent_wire import SilentWire

    with ExitStack() as opened:
        nav2 = Program(opened, "sim_fakes.wire.nav2_process")
        endpoint = nav2.expect("endpoint", START_S)["endpoint"]
        config = Path(opened.enter_context(tempfile.TemporaryDirectory())) / "robot.toml"
        onboard = '[onboard]\ncamera = "sim"\nlidar = "sim"\n' if sensors else ""
        config.write_text(f'[zenoh]\nendpoint = "{endpoint}"\n{onboard}', encoding="utf-8")
        Program(opened, "robot_app.cli", "onboard", "--config", str(config))
        view = WatchdogView(opened.enter_context(ZenohLink(LinkConfig((endpoint,)))))
        view.start()
        end_s = time.monotonic() + START_S
        while view.status is None:
            if time.monotonic() > end_s:
                raise Failure(f"openbelief onboard did not tell its state within {START_S:g} s")
            time.sleep(0.05)
        yield Bench(nav2, opened.enter_context(SilentWire(endpoint)), view)


# name -> what happens to the workstation
LOSSES: dict[str, Callable[[Program, Any], None]] = {
    "SIGKILL": lambda workstation, _: os.kill(workstation.pid, signal.SIGKILL),
    "SIGSTOP": lambda workstation, _: os.kill(workstation.pid, signal.SIGSTOP),
    "cut link": lambda _, wire: wire.cut(),
}


def _table(result: dict[str, dict[str, Any]]) -> str:
    head = f"{'loss':<10}{'runs':>6}{'median':>10}{'worst':>10}"
    rows = [f"{n:<10}{t['runs']:>6}{t['median_s']:>8.3f} s{t['worst_s']:>8.3f} s" for n, t in result.items()]
    return "\n".join([head, *rows])


def _runs(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 1000:
        raise argparse.ArgumentTypeError(f"runs must be a whole number from 1 to 1000, got '{text}'")
    return int(text)
