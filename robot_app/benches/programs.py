"""Real processes for benches and tests: a program with a pipe or a terminal, and a robot on an empty floor to ask."""

from __future__ import annotations

import json
import os
import pty
import queue
import select
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from robot_app.cli import Failure

START_S = 60.0  # a bound on hanging: a busy machine loads libraries for half a minute
THING = "fire extinguisher"
THING_AT = (10.0, 9.0, 0.4)  # ten metres from where the robot of sim_fakes.wire.nav2_process stands


class Program:
    """A Python module as a process of its own, in a session of its own; `expect` waits for its next JSON line with that
    key, `said` for words on its screen.

    terminal: its input and its screen are one, which `hang_up` closes. dark: its input is /dev/null.
    """

    def __init__(
        self,
        opened: ExitStack,
        module: str,
        *arguments: str,
        terminal: bool = False,
        dark: bool = False,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._name, self._terminal = module, -1
        streams: dict[str, Any] = {"stdin": subprocess.PIPE, "stderr": subprocess.PIPE}
        if dark:
            streams["stdin"] = subprocess.DEVNULL
        if terminal:
            self._terminal, slave = pty.openpty()
            streams = {"stdin": slave, "stderr": slave}
        self._process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments],
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env=os.environ | dict(environment or {}),
            **streams,
        )
        if terminal:
            os.close(slave)
        self._lines: queue.Queue[dict[str, Any]] = queue.Queue()
        self._screen: list[str] = []
        self.pid = self._process.pid
        threading.Thread(target=self._read, daemon=True).start()
        self._hung_up = threading.Event()
        self._watching = threading.Thread(target=self._watch, daemon=True)
        self._watching.start()
        opened.callback(self.kill)

    def expect(self, key: str, timeout_s: float = START_S) -> dict[str, Any]:
        end_s = time.monotonic() + timeout_s
        while (left_s := end_s - time.monotonic()) > 0:
            try:
                line = self._lines.get(timeout=left_s)
            except queue.Empty:
                break
            if key in line:
                return line
        raise Failure(f"{self._name} did not report {key!r} within {timeout_s:g} s ({self.last})")

    def said(self, words: str, timeout_s: float = START_S) -> str:
        """The line on its screen that holds these words."""
        end_s = time.monotonic() + timeout_s
        while time.monotonic() < end_s:
            if found := [line for line in self._screen if words in line]:
                return found[0]
            time.sleep(0.01)
        raise Failure(f"{self._name} did not say {words!r} within {timeout_s:g} s ({self.last})")

    def heard(self, words: str) -> bool:
        """Whether they are on its screen by now."""
        return any(words in line for line in self._screen)

    @property
    def last(self) -> str:
        return self._screen[-1] if self._screen else "it said nothing"

    @property
    def ended(self) -> bool:
        return self._process.poll() is not None

    def forget(self) -> None:
        """What it reported so far."""
        while not self._lines.empty():
            self._lines.get_nowait()

    def type(self, line: str) -> None:
        if self._terminal >= 0:
            os.write(self._terminal, f"{line}\n".encode())
        elif self._process.stdin is not None:
            self._process.stdin.write(f"{line}\n")
            self._process.stdin.flush()

    def hang_up(self) -> int:
        """The other end of its terminal goes; its session has no controlling terminal, so no SIGHUP comes.

        Returns when that was, in nanoseconds of the monotonic clock.
        """
        self._hung_up.set()
        self._watching.join()
        terminal, self._terminal = self._terminal, -1
        gone_ns = time.monotonic_ns()
        os.close(terminal)
        return gone_ns

    def signal(self, number: int) -> None:
        os.kill(self.pid, number)

    def wait(self, timeout_s: float = START_S) -> int:
        """Its exit status."""
        return self._process.wait(timeout_s)

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()
        if self._terminal >= 0:
            self.hang_up()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            with suppress(json.JSONDecodeError):  # a line for people
                self._lines.put(json.loads(line))

    def _watch(self) -> None:
        lines = self._process.stderr if self._terminal < 0 else self._terminal_lines()
        assert lines is not None
        for line in lines:
            self._screen = [*self._screen[-200:], line.strip()]

    def _terminal_lines(self) -> Iterator[str]:
        """What it writes, until `hang_up`; nobody else may hold the terminal's other end open."""
        rest = ""
        with suppress(OSError):  # a terminal whose program has ended reads an error
            while not self._hung_up.is_set():
                if select.select([self._terminal], [], [], 0.02)[0]:
                    *lines, rest = (rest + os.read(self._terminal, 4096).decode(errors="replace")).split("\n")
                    yield from lines


def own_dds() -> dict[str, str]:
    """An environment in which DDS stays on this machine's loopback, in a domain that few others use."""
    interfaces = '<Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>'
    discovery = "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>"
    peers = '<Peers><Peer address="127.0.0.1"/></Peers>'
    uri = (
        f"<CycloneDDS><Domain><General>{interfaces}<AllowMulticast>false</AllowMulticast></General>"
        f"<Discovery>{discovery}{peers}</Discovery></Domain></CycloneDDS>"
    )
    return {"CYCLONEDDS_URI": uri, "ROS_DOMAIN_ID": str(100 + os.getpid() % 100)}


def write_configuration(folder: Path, endpoint: str, more: str = "") -> Path:
    """A memory of one thing on the empty floor and a robot.toml that drives to it; the configuration's path."""
    import numpy as np

    from openbelief.memory import ObjectMemory
    from openbelief.observation import Observation
    from openbelief.parameters import Parameters
    from openbelief.perception.sentence import SentenceEncoder

    encoder = SentenceEncoder()
    points = np.random.default_rng(0).uniform(-0.2, 0.2, (400, 3)) + THING_AT
    seen = [
        Observation(frame, 0, THING, 0.9, points.astype(np.float32), encoder.encode([THING])[0]) for frame in range(3)
    ]
    ObjectMemory.build(seen, encoder, Parameters()).save(folder / "site.belief")
    ports = "".join(f'{port} = "ros"\n' for port in ("camera", "lidar", "pose", "map", "navigator"))
    config = folder / "robot.toml"
    config.write_text(
        f'memory = "site.belief"\n[ports]\n{ports}[zenoh]\nendpoint = "{endpoint}"\n'
        f'[perception]\nprofile = "scripted:flat"\n{more}',
        encoding="utf-8",
    )
    return config


def until(what: str, condition: Callable[[], bool], timeout_s: float = START_S) -> None:
    """Raises Failure."""
    end_s = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > end_s:
            raise Failure(f"{what} did not come within {timeout_s:g} s")
        time.sleep(0.02)
