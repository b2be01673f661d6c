"""How the emulated lidar answers control frames: search, set and get, with the return codes of the real one."""

from __future__ import annotations

from drivers.livox import control_wire
from drivers.livox.control_wire import CommandId, ControlFrame, Found
from drivers.livox.keys import READ_ONLY_FROM, Key
from drivers.livox.wire import DataType, LivoxWireError
from sim_fakes.sensors.livox_stream import LivoxStream

LENGTHS = {
    Key.DATA_TYPE: 1,
    Key.PATTERN: 1,
    Key.LIDAR_IP: 12,
    Key.STATE_DESTINATION: 8,
    Key.POINTS_DESTINATION: 8,
    Key.IMU_DESTINATION: 8,
    Key.ATTITUDE: 24,
    Key.WORK_MODE: 1,
    Key.IMU_ENABLE: 1,
}
DESTINATIONS = {Key.STATE_DESTINATION: "push", Key.POINTS_DESTINATION: "points", Key.IMU_DESTINATION: "imu"}
RANGES = {Key.DATA_TYPE: (1, 2, 3), Key.PATTERN: (0, 1, 2), Key.IMU_ENABLE: (0, 1)}
DONE, OUT_OF_RANGE, UNSUPPORTED, READ_ONLY, BAD_LENGTH, COUNT_MISMATCH = 0, 3, 0x20, 0x22, 0x23, 0x24


class LivoxAnswers:
    """Holds the written keys; a written destination takes effect at once in `destinations`."""

    def __init__(self, stream: LivoxStream, found: Found, destinations: dict[str, tuple[str, int]]) -> None:
        self.written: dict[int, bytes] = {}
        self.destinations = destinations
        self._stream, self._found = stream, found

    def answer(self, request: ControlFrame) -> ControlFrame | None:
        """The ACK; None for what is no request to a lidar, and for the upgrade and reboot commands."""
        if request.is_ack or request.from_lidar:
            return None
        if request.command == CommandId.SEARCH:
            return control_wire.search_ack(request.seq, self._found)
        if request.command == CommandId.SET:
            return control_wire.set_ack(request.seq, *self._set(request.data))
        if request.command == CommandId.GET:
            return self._get(request)
        return None

    def _set(self, data: bytes) -> tuple[int, int]:
        """(return code, offending key). All or nothing."""
        try:
            values = control_wire.parse_values(data)
        except LivoxWireError:
            return COUNT_MISMATCH, 0
        for key, value in values.items():
            if code := self._refusal(key, value):
                return code, key
        for key, value in values.items():
            self._write(key, value)
        return DONE, 0

    @staticmethod
    def _refusal(key: int, value: bytes) -> int:
        if key >= READ_ONLY_FROM:
            return READ_ONLY
        if key not in LENGTHS:
            return UNSUPPORTED
        if len(value) != LENGTHS[Key(key)]:
            return BAD_LENGTH
        return OUT_OF_RANGE if key in RANGES and value[0] not in RANGES[Key(key)] else DONE

    def _write(self, key: int, value: bytes) -> None:
        self.written[key] = value
        if key in DESTINATIONS:
            ip, port, _ = control_wire.parse_endpoint(value)
            self.destinations[DESTINATIONS[Key(key)]] = (ip, port)
        elif key == Key.DATA_TYPE:
            self._stream.set_data_type(DataType(value[0]))
        elif key == Key.WORK_MODE:
            self._stream.work_state = value[0]
        elif key == Key.IMU_ENABLE:
            self._stream.imu_on = bool(value[0])

    def _get(self, request: ControlFrame) -> ControlFrame:
        known = {**self.written, **self._stream.values()}
        try:
            keys = control_wire.parse_get_request(request.data)
        except LivoxWireError:
            return control_wire.get_ack(request.seq, COUNT_MISMATCH, {})
        if any(key not in known for key in keys):
            return control_wire.get_ack(request.seq, UNSUPPORTED, {})
        return control_wire.get_ack(request.seq, DONE, {key: known[key] for key in keys})
