"""The MID-360 as a Lidar port: a passive receiver of its points, IMU and push messages.

It binds the host's ports and listens; nothing is sent unless `take_control` is set (see takeover.py). A thread drains
the sockets a hundred times a second, which costs less than waking for each of 2083 packets a second.
"""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from dataclasses import dataclass

from drivers.livox.assembler import LivoxCloud
from drivers.livox.intake import DatagramDecoder, LidarState, LivoxImuSample
from drivers.livox.keys import Key
from drivers.livox.settings import LivoxPorts, LivoxSettings
from drivers.livox.takeover import LivoxControl, redirect
from drivers.ports import Clock, LinkLost, PortError, StaleData
from drivers.stamps import OWN_CLOCK, require_fresh
from openbelief.lifetime import Lifetime

RECEIVE_BUFFER = 8 * 1024 * 1024  # asked for; Linux grants twice net.core.rmem_max at most
DRAIN_EVERY_S = 0.01
DRAIN_AT_MOST = 4096  # datagrams of one port before the others have their turn
DATAGRAM = 2048  # longer than any packet of the lidar


@dataclass(frozen=True)
class LivoxHealth:
    """Counts since start: `refused` by reason, `foreign` from other addresses; `late`, `overfull` and `cut` are packets
    in no cloud, the last because in the middle of one the lidar's clock was set (`clock_changes`) or it started anew
    (`restarts`).

    `receive_buffer_bytes` is what the system granted.
    """

    packets: int
    lost: int
    duplicates: int
    out_of_order: int
    late: int
    overfull: int
    cut: int
    clock_changes: int
    restarts: int
    imu_packets: int
    imu_lost: int
    clouds: int
    refused: dict[str, int]
    foreign: int
    receive_buffer_bytes: int
    state: LidarState | None


class LivoxLidar(Lifetime):
    """Construct, then `start()` (or `with`): `latest` is the Lidar port; `take_clouds` and `take_imu` serve a recorder.

    Raises PortError from `start` where a port is taken, LinkLost from any read once the receiver has failed.
    """

    def __init__(self, settings: LivoxSettings, clock: Clock, ports: LivoxPorts | None = None) -> None:
        self._settings, self._clock, self._ports = settings, clock, ports or LivoxPorts()
        self._intake = DatagramDecoder(settings.frame_id)
        self._lock, self._stop = threading.Lock(), threading.Event()
        self._sockets: dict[str, socket.socket] = {}
        self._thread: threading.Thread | None = None
        self._failure: BaseException | None = None
        self._foreign = self._granted = 0

    def start(self) -> None:
        if self._thread is not None:
            raise PortError("This lidar driver was started before; construct a new one.")
        try:
            for name in ("points", "imu", "push"):
                self._sockets[name] = self._listen(name)
            self._granted = self._sockets["points"].getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
            if self._settings.take_control:
                self._take_control()
        except BaseException:
            self._close_sockets()
            raise
        self._thread = threading.Thread(target=self._receive, name="livox-receiver", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        self._close_sockets()

    @property
    def ports(self) -> dict[str, int]:
        """The bound host ports by stream; useful where LivoxPorts says 0."""
        return {name: connection.getsockname()[1] for name, connection in self._sockets.items()}

    def latest(self, max_age_s: float) -> LivoxCloud:
        """The newest cloud; its age counts from its last point. Raises StaleData, or LinkLost after a failure."""
        with self._lock:
            cloud = self._intake.latest
        self._raise_failure()
        if cloud is None:
            raise StaleData(
                f"No lidar cloud yet from {self._settings.lidar_ip}: check that the lidar runs and sends to this host."
            )
        require_fresh("The lidar", cloud.end_ns, self._clock.now_ns(), max_age_s, ahead=OWN_CLOCK)
        return cloud

    def take_clouds(self) -> list[LivoxCloud]:
        """The clouds since the last call, two seconds at most; a gap in `sequence` tells what was not taken in time."""
        with self._lock:
            clouds = list(self._intake.clouds)
            self._intake.clouds.clear()
        self._raise_failure()
        return clouds

    def take_imu(self) -> list[LivoxImuSample]:
        """The IMU samples since the last call, the newest ten seconds at most."""
        with self._lock:
            samples = list(self._intake.imu_samples)
            self._intake.imu_samples.clear()
        self._raise_failure()
        return samples

    def health(self) -> LivoxHealth:
        with self._lock:
            intake = self._intake
            return LivoxHealth(
                packets=intake.points.received,
                lost=intake.points.lost,
                duplicates=intake.points.duplicates + intake.imu.duplicates,
                out_of_order=intake.points.out_of_order + intake.imu.out_of_order,
                late=intake.assembler.late,
                overfull=intake.assembler.overfull,
                cut=intake.assembler.cut,
                clock_changes=intake.clock_changes,
                restarts=intake.restarts,
                imu_packets=intake.imu.received,
                imu_lost=intake.imu.lost,
                clouds=intake.cloud_count,
                refused={refusal.value: count for refusal, count in intake.refused.items()},
                foreign=self._foreign,
                receive_buffer_bytes=self._granted,
                state=intake.state,
            )

    def _listen(self, name: str) -> socket.socket:
        address = (self._settings.host_ip, getattr(self._ports, name))
        connection = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
            connection.bind(address)
            connection.setblocking(False)
        except OSError as error:
            connection.close()
            raise PortError(
                f"Cannot listen for lidar {name} on {address[0]}:{address[1]} ({error.strerror}): "
                "is host_ip this machine's address, and does another program (the vendor's driver?) hold the port?"
            ) from error
        return connection

    def _take_control(self) -> None:
        settings, lidar, ports = self._settings, self._ports, self.ports
        with self._listen("command") as connection:
            redirect(
                LivoxControl(connection, (settings.lidar_ip, lidar.lidar_command)),
                settings.host_ip,
                {
                    Key.STATE_DESTINATION: (ports["push"], lidar.lidar_push),
                    Key.POINTS_DESTINATION: (ports["points"], lidar.lidar_points),
                    Key.IMU_DESTINATION: (ports["imu"], lidar.lidar_imu),
                },
            )

    def _receive(self) -> None:
        take = {"points": self._intake.take_points, "imu": self._intake.take_imu, "push": self._intake.take_push}
        try:
            while not self._stop.wait(DRAIN_EVERY_S):
                for name, connection in self._sockets.items():
                    self._drain(connection, take[name])
        except BaseException as failure:  # noqa: BLE001 - handed to whoever reads next, by _raise_failure
            self._failure = failure

    def _drain(self, connection: socket.socket, take: Callable[[bytes, int], None]) -> None:
        with self._lock:
            for _ in range(DRAIN_AT_MOST):
                try:
                    datagram, source = connection.recvfrom(DATAGRAM)
                except BlockingIOError:
                    return
                if source[0] == self._settings.lidar_ip:
                    take(datagram, self._clock.now_ns())
                else:
                    self._foreign += 1

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise LinkLost(f"The lidar receiver has stopped: {self._failure}.") from self._failure

    def _close_sockets(self) -> None:
        for connection in self._sockets.values():
            connection.close()
        self._sockets = {}
