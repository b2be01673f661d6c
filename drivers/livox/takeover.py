"""Writing to the lidar: only on explicit order, for it takes the stream away from whoever had it.

On a G1 that is Unitree's own driver. Nothing here is called unless the configuration says `take_control = true`.
"""

from __future__ import annotations

import socket
from collections.abc import Mapping

from drivers.livox import control_wire
from drivers.livox.control_wire import CommandId, ControlFrame
from drivers.livox.keys import RETURN_CODES, SAMPLING, Key, word
from drivers.livox.wire import LivoxWireError
from drivers.ports import LinkLost, PortError

TRIES = 3
ACK_TIMEOUT_S = 0.5
STRAY_FRAMES = 32  # read while waiting for one ACK


class LivoxControl:
    """Requests with ACKs over one socket; `connection` is bound to the host's command port."""

    def __init__(self, connection: socket.socket, lidar: tuple[str, int]) -> None:
        self._socket, self._lidar, self._seq = connection, lidar, 0

    def set(self, values: Mapping[int, bytes]) -> None:
        """Raises PortError naming the key the lidar refused, LinkLost where it stays silent."""
        data = self._ask(control_wire.set_request(self._next(), values))
        try:
            code, key = control_wire.parse_set_ack(data)
        except LivoxWireError as error:
            raise PortError(f"The lidar's answer to SET cannot be read: {error}") from error
        if code:
            raise PortError(f"The lidar refused to set key {key:#06x}: {word(RETURN_CODES, code)}.")

    def _next(self) -> int:
        self._seq += 1
        return self._seq

    def _ask(self, request: ControlFrame) -> bytes:
        name, (ip, port) = CommandId(request.command).name, self._lidar
        self._socket.settimeout(ACK_TIMEOUT_S)
        for _ in range(TRIES):
            try:
                self._socket.sendto(control_wire.encode(request), self._lidar)
            except OSError as error:
                raise LinkLost(f"The lidar at {ip}:{port} cannot be reached from here ({error.strerror}).") from error
            ack = self._await_ack(request)
            if ack is not None:
                return ack.data
        raise LinkLost(
            f"The lidar at {ip}:{port} did not answer {name} in {TRIES} tries: check its address and the cable."
        )

    def _await_ack(self, request: ControlFrame) -> ControlFrame | None:
        for _ in range(STRAY_FRAMES):
            try:
                datagram, source = self._socket.recvfrom(2048)
                frame = control_wire.decode(datagram)
            except TimeoutError:
                return None
            except LivoxWireError:
                continue  # a corrupted ACK is no ACK: the request is sent again
            if source[0] == self._lidar[0] and frame.is_ack and frame[:2] == request[:2]:
                return frame
        return None


def redirect(control: LivoxControl, host_ip: str, ports: Mapping[Key, tuple[int, int]]) -> None:
    """Send the streams to `host_ip` ({destination key: (host port, lidar port)}) and start sampling, IMU included."""
    values = {int(key): control_wire.endpoint(host_ip, *pair) for key, pair in ports.items()}
    control.set({**values, Key.IMU_ENABLE: b"\x01", Key.WORK_MODE: bytes([SAMPLING])})
