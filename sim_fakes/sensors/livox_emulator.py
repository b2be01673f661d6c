"""A MID-360 on loopback: the sensor's own datagrams from 127.0.0.2, answers to control frames, faults on demand.

As a program (`python -m sim_fakes.sensors.livox_emulator --help`) it runs in a process of its own, for benchmarks
and by hand, and prints what it sent as JSON.
"""

from __future__ import annotations

import argparse
import json
import socket
import sys
import threading
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

from drivers.clock import SystemClock
from drivers.livox import control_wire
from drivers.livox.control_wire import ControlFrame, Found
from drivers.livox.wire import LivoxWireError
from drivers.ports import Clock
from openbelief.lifetime import Lifetime
from sim_fakes.sensors.livox_answers import LivoxAnswers
from sim_fakes.sensors.livox_faults import LivoxFaults
from sim_fakes.sensors.livox_scan import RangeSource, open_room
from sim_fakes.sensors.livox_stream import LivoxStream, Outgoing

STEP_S = 0.005
KEPT_FRAMES = 1000


@dataclass(frozen=True, kw_only=True)
class EmulatorSettings:
    """The factory's ports; a lidar port of 0 takes any free one (but the SDK routes by the factory's)."""

    lidar_ip: str = "127.0.0.2"
    host_ip: str = "127.0.0.1"
    search_port: int = 56000
    command_port: int = 56100
    push_port: int = 56200
    points_port: int = 56300
    imu_port: int = 56400
    host_search_port: int = 56000
    host_push_port: int = 56201
    host_points_port: int = 56301
    host_imu_port: int = 56401
    device_type: int = 9
    serial: str = "EMULATED0000360"


class Received(NamedTuple):
    """A datagram the lidar got; `frame` is None where it was no valid control frame."""

    channel: str
    source: tuple[str, int]
    frame: ControlFrame | None


class LivoxEmulator(Lifetime):
    """Driven by hand (`open`, then `advance_to`) in tests, or by a thread of its own (`with`)."""

    def __init__(
        self,
        settings: EmulatorSettings | None = None,
        *,
        clock: Clock,
        ranges: RangeSource = open_room,
        faults: LivoxFaults | None = None,
    ) -> None:
        self.settings = settings or EmulatorSettings()
        self.faults = faults or LivoxFaults()
        self.received: deque[Received] = deque(maxlen=KEPT_FRAMES)
        self._clock, self._ranges = clock, ranges
        self._sockets: dict[str, socket.socket] = {}
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def open(self) -> None:
        """Bind the lidar's ports. Raises OSError where one is taken."""
        for channel in ("search", "command", "push", "points", "imu"):
            connection = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._sockets[channel] = connection
            connection.bind((self.settings.lidar_ip, getattr(self.settings, f"{channel}_port")))
            connection.setblocking(False)
        found = Found(self.settings.device_type, self.settings.serial, self.settings.lidar_ip, self.ports["command"])
        channels = ("search", "push", "points", "imu")
        hosts = {name: (self.settings.host_ip, getattr(self.settings, f"host_{name}_port")) for name in channels}
        self.stream = LivoxStream(self._ranges, found)
        self.answers = LivoxAnswers(self.stream, found, hosts)
        self._born_ns = self._clock.now_ns()

    @property
    def ports(self) -> dict[str, int]:
        """The lidar's bound ports by channel."""
        return {channel: connection.getsockname()[1] for channel, connection in self._sockets.items()}

    def advance_to(self, now_ns: int) -> None:
        """Answer what has come in, then send everything due until `now_ns` of the clock."""
        for channel in ("search", "command"):
            self._answer(channel)
        for outgoing in self.faults.apply(self.stream.due(now_ns - self._born_ns)):
            self._send(outgoing)

    def close(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        for connection in self._sockets.values():
            connection.close()

    def start(self) -> None:
        self.open()
        self._thread = threading.Thread(target=self._run, name="livox-emulator", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._stop.wait(STEP_S):
            self.advance_to(self._clock.now_ns())

    def _send(self, outgoing: Outgoing) -> None:
        self._sockets[outgoing.channel].sendto(outgoing.datagram, self.answers.destinations[outgoing.channel])

    def _answer(self, channel: str) -> None:
        connection = self._sockets[channel]
        while True:
            try:
                datagram, source = connection.recvfrom(2048)
            except BlockingIOError:
                return
            frame = _frame(datagram)
            self.received.append(Received(channel, source, frame))
            ack = self.answers.answer(frame) if frame else None
            if ack is not None and not self.faults.silent:
                connection.sendto(control_wire.encode(ack), source)


def _frame(datagram: bytes) -> ControlFrame | None:
    try:
        return control_wire.decode(datagram)
    except LivoxWireError:
        return None  # a real lidar ignores it too; the caller records that it came


def main() -> None:
    parser = argparse.ArgumentParser(prog="livox_emulator", description=__doc__)
    parser.add_argument("--seconds", type=float, default=30.0, help="how long to send")
    for name in ("lidar", "host"):
        default = getattr(EmulatorSettings, f"{name}_ip")
        parser.add_argument(f"--{name}-ip", default=default, help="a loopback address")
    for name in ("points", "imu", "push"):
        default = getattr(EmulatorSettings, f"host_{name}_port")
        parser.add_argument(f"--host-{name}-port", type=int, default=default, help=f"where {name} go")
    parser.add_argument("--any-lidar-port", action="store_true", help="do not insist on the factory's source ports")
    options = vars(parser.parse_args())
    seconds, any_port = options.pop("seconds"), options.pop("any_lidar_port")
    if any_port:
        options |= dict.fromkeys(("search_port", "command_port", "push_port", "points_port", "imu_port"), 0)
    clock = SystemClock()
    emulator = LivoxEmulator(EmulatorSettings(**options), clock=clock)
    emulator.open()
    end_ns = clock.now_ns() + round(seconds * 1e9)
    while (now_ns := clock.now_ns()) < end_ns:
        emulator.advance_to(now_ns)
        clock.sleep(STEP_S)
    emulator.advance_to(end_ns)
    emulator.close()
    json.dump(emulator.stream.sent, sys.stdout)


if __name__ == "__main__":
    main()
