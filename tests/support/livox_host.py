"""The control frames of a host that our driver never sends: to find a lidar, and to read its keys."""

from __future__ import annotations

import ipaddress
import struct
from collections.abc import Sequence

from drivers.livox.control_wire import CommandId, ControlFrame, Found, parse_key_values, text


def search_request(seq: int) -> ControlFrame:
    return ControlFrame(seq, CommandId.SEARCH)


def parse_search_ack(data: bytes) -> Found:
    _, device_type, serial, ip, port = struct.unpack("<BB16s4sH", data)
    return Found(device_type, text(serial), str(ipaddress.IPv4Address(ip)), port)


def get_request(seq: int, keys: Sequence[int]) -> ControlFrame:
    return ControlFrame(seq, CommandId.GET, struct.pack(f"<HH{len(keys)}H", len(keys), 0, *keys))


def parse_get_ack(data: bytes) -> tuple[int, dict[int, bytes]]:
    """(return code, values)."""
    code, count = struct.unpack_from("<BH", data)
    return code, parse_key_values(data, count, 3)
