"""Real ROS 2 processes in .venv-ros, and our own drivers on the other end of a Zenoh router."""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from drivers.ros.zenoh_link import LinkConfig, ZenohLink, open_router

HERE = Path(__file__).parent
VENV = HERE.parents[1] / ".venv-ros"
PYTHON = VENV / "bin" / "python"
READY_S = 60.0  # a loaded machine loads the wheels' 300 MB slowly


class Process:
    """One script in .venv-ros, killed at the end whatever happens; its output stays in a file."""

    def __init__(self, script: str, arguments: tuple[str, ...], environment: dict[str, str], log: Path) -> None:
        self.log, self.reports = log, []
        with log.open("ab") as errors:
            self._process = subprocess.Popen(
                [str(PYTHON), str(HERE / script), *arguments],
                stdin=subprocess.PIPE,  # lifeline.py: it ends when we do
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                env=environment,
                start_new_session=True,
            )

    def wait_ready(self) -> None:
        lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=lambda: lines.put(self._process.stdout.readline()), daemon=True).start()
        try:
            said = lines.get(timeout=READY_S)
        except queue.Empty:
            said = f"nothing within {READY_S:g} s"
        if said != "ready\n":
            self.kill()
            pytest.fail(f"The ROS 2 process did not start ({said!r}):\n{self.log.read_text()[-3000:]}")
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        """What it reports once it is ready."""
        with suppress(ValueError):  # closed by kill()
            for line in self._process.stdout:
                self.reports.append(json.loads(line))

    def kill(self) -> None:
        """SIGKILL: rclpy and zenoh in one process may ignore anything gentler."""
        if self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait(10)
        for pipe in (self._process.stdin, self._process.stdout):
            pipe.close()


@dataclass
class Peer:
    """A ROS 2 robot behind a router: `server` is the node with the actions, `bridge` what carries it over Zenoh."""

    endpoint: str
    logs: Path
    environment: dict[str, str]
    running: dict[str, Process] = field(default_factory=dict)

    def start(self, *names: str) -> None:
        """server, bridge: started side by side, ready when this returns."""
        for name in names:
            arguments = (self.endpoint,) if name == "bridge" else ()
            log = self.logs / f"{name}.log"
            self.running[name] = Process(f"{name}.py", arguments, self.environment, log)
        for name in names:
            self.running[name].wait_ready()

    def kill(self, name: str) -> None:
        self.running.pop(name).kill()

    @contextmanager
    def link(self) -> Iterator[ZenohLink]:
        with ZenohLink(LinkConfig((self.endpoint,))) as link:
            yield link


def ros_environment(logs: Path) -> dict[str, str]:
    """ROS on this machine's loopback only, in a domain that nobody else here uses at the moment."""
    settings = {
        "ROS_DOMAIN_ID": str(1 + os.getpid() % 100),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",  # shared memory would outlive a killed process
        "ROS_LOG_DIR": str(logs),
        "PYTHONUNBUFFERED": "1",
    }
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("ROS_", "RMW_", "FASTDDS_", "PYTHON"))}
    return inherited | settings


@pytest.fixture(scope="session")
def ros_python() -> Path:
    """The interpreter that has ROS 2."""
    if not (VENV / ".ready").exists():
        pytest.skip("no real ROS 2 peer: .venv-ros is missing (make ros-peer sets it up)")
    return PYTHON


@pytest.fixture(scope="session")
def peer(ros_python: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Peer]:
    """Server and bridge, up."""
    logs = tmp_path_factory.mktemp("ros_peer")
    with ExitStack() as opened:
        made = Peer(opened.enter_context(open_router()), logs, ros_environment(logs))
        opened.callback(lambda: [process.kill() for process in made.running.values()])
        made.start("server", "bridge")
        yield made


@pytest.fixture
def link(peer: Peer) -> Iterator[ZenohLink]:
    with peer.link() as opened:
        yield opened
