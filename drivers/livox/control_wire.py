"""MID-360 control frames: search, set, get and push with their ACKs, both ways.

24 bytes of header and up to 1400 of data. CRC-16/CCITT-FALSE covers bytes 0-17, CRC-32 the data (0 where there is
none), so that a flip of any bit is refused. The upgrade commands (0x04xx) are not here and must never be.
"""

from __future__ import annotations

import binascii
import ipaddress
import struct
import zlib
from collections.abc import Mapping
from enum import IntEnum
from typing import NamedTuple

from drivers.livox.wire import LivoxWireError, PacketRefusal

HEADER = struct.Struct("<BBHIHBB6xHI")  # sof version length seq cmd_id cmd_type sender reserved crc16 crc32
SOF = 0xAA
CRC16_OVER = 18
MAX_DATA = 1400
_SEARCH_ACK = struct.Struct("<BB16s4sH")
_ENDPOINT = struct.Struct("<4sHH")


class CommandId(IntEnum):
    SEARCH = 0x0000
    SET = 0x0100
    GET = 0x0101
    PUSH = 0x0102


class ControlFrame(NamedTuple):
    """One frame; an ACK echoes its request's `seq`."""

    seq: int
    command: int
    data: bytes = b""
    is_ack: bool = False
    from_lidar: bool = False


class Found(NamedTuple):
    """A search ACK's contents."""

    device_type: int
    serial: str
    ip: str
    command_port: int


def encode(frame: ControlFrame) -> bytes:
    """Raises ValueError where the data is longer than a frame can carry."""
    if len(frame.data) > MAX_DATA:
        raise ValueError(f"A control frame carries at most {MAX_DATA} bytes, got {len(frame.data)}.")
    length = HEADER.size + len(frame.data)
    kinds = (frame.command, frame.is_ack, frame.from_lidar)
    head = HEADER.pack(SOF, 0, length, frame.seq, *kinds, 0, 0)[:CRC16_OVER]
    return head + struct.pack("<HI", binascii.crc_hqx(head, 0xFFFF), zlib.crc32(frame.data)) + frame.data


def decode(datagram: bytes) -> ControlFrame:
    """Raises LivoxWireError for anything that is not one whole, uncorrupted frame."""
    if len(datagram) < HEADER.size:
        raise LivoxWireError(
            PacketRefusal.SHORT, f"A control frame has {HEADER.size} bytes or more, got {len(datagram)}."
        )
    sof, version, length, seq, command, kind, sender, crc16, crc32 = HEADER.unpack_from(datagram)
    if sof != SOF or version != 0:
        raise LivoxWireError(PacketRefusal.VERSION, f"Start byte {sof:#04x}, version {version}: no version 0 frame.")
    if length != len(datagram) or length > HEADER.size + MAX_DATA:
        raise LivoxWireError(PacketRefusal.LENGTH, f"The control frame says {length} bytes, {len(datagram)} arrived.")
    data = datagram[HEADER.size :]
    if binascii.crc_hqx(datagram[:CRC16_OVER], 0xFFFF) != crc16 or zlib.crc32(data) != crc32:
        raise LivoxWireError(PacketRefusal.CHECKSUM, "The control frame's checksum does not match its contents.")
    if kind > 1 or sender > 1:
        raise LivoxWireError(PacketRefusal.TYPE, f"Control frame of kind {kind} from sender {sender} is unknown.")
    return ControlFrame(seq, command, bytes(data), bool(kind), bool(sender))


def endpoint(ip: str, dst_port: int, src_port: int) -> bytes:
    """The value of a destination key: where to send, and from which of the lidar's ports."""
    return _ENDPOINT.pack(ipaddress.IPv4Address(ip).packed, dst_port, src_port)


def parse_endpoint(value: bytes) -> tuple[str, int, int]:
    """(ip, dst_port, src_port) of a destination key."""
    ip, dst_port, src_port = _unpack(_ENDPOINT, value)
    return str(ipaddress.IPv4Address(ip)), dst_port, src_port


def key_values(values: Mapping[int, bytes]) -> bytes:
    """{key u16, length u16, value} one after the other."""
    return b"".join(struct.pack("<HH", key, len(value)) + value for key, value in values.items())


def parse_key_values(data: bytes, count: int, offset: int) -> dict[int, bytes]:
    """Exactly `count` entries from `offset` to the end; raises LivoxWireError on a shortfall or a rest."""
    values: dict[int, bytes] = {}
    for _ in range(count):
        if offset + 4 > len(data):
            raise LivoxWireError(PacketRefusal.LENGTH, f"{count} keys were announced, {len(values)} are there.")
        key, length = struct.unpack_from("<HH", data, offset)
        offset += 4 + length
        if offset > len(data):
            raise LivoxWireError(PacketRefusal.LENGTH, f"The value of key {key:#06x} is cut off.")
        values[key] = data[offset - length : offset]
    if offset != len(data):
        raise LivoxWireError(PacketRefusal.LENGTH, f"{len(data) - offset} bytes follow the last of {count} keys.")
    return values


def search_ack(seq: int, found: Found) -> ControlFrame:
    ip = ipaddress.IPv4Address(found.ip).packed
    data = _SEARCH_ACK.pack(0, found.device_type, found.serial.encode("ascii"), ip, found.command_port)
    return ControlFrame(seq, CommandId.SEARCH, data, is_ack=True, from_lidar=True)


def set_request(seq: int, values: Mapping[int, bytes]) -> ControlFrame:
    return ControlFrame(seq, CommandId.SET, struct.pack("<HH", len(values), 0) + key_values(values))


def push_request(seq: int, values: Mapping[int, bytes]) -> ControlFrame:
    """What the lidar sends unasked, once a second: its state, temperature and health codes."""
    return set_request(seq, values)._replace(command=CommandId.PUSH, from_lidar=True)


def parse_values(data: bytes) -> dict[int, bytes]:
    """The key-values of a set request or of a push message."""
    return parse_key_values(data, _count(data), 4)


def set_ack(seq: int, code: int, error_key: int = 0) -> ControlFrame:
    return ControlFrame(seq, CommandId.SET, struct.pack("<BH", code, error_key), is_ack=True, from_lidar=True)


def parse_set_ack(data: bytes) -> tuple[int, int]:
    """(return code, offending key)."""
    code, key = _unpack(struct.Struct("<BH"), data)
    return code, key


def parse_get_request(data: bytes) -> list[int]:
    count = _count(data)
    return list(_unpack(struct.Struct(f"<{count}H"), data[4:]))


def get_ack(seq: int, code: int, values: Mapping[int, bytes]) -> ControlFrame:
    data = struct.pack("<BH", code, len(values)) + key_values(values)
    return ControlFrame(seq, CommandId.GET, data, is_ack=True, from_lidar=True)


def text(value: bytes) -> str:
    """A zero-padded ASCII field; anything unprintable shows as '?'."""
    return "".join(chr(byte) if 32 <= byte < 127 else "?" for byte in value.split(b"\0")[0])


def _count(data: bytes) -> int:
    if len(data) < 4:
        raise LivoxWireError(PacketRefusal.SHORT, f"A key list has at least 4 bytes, got {len(data)}.")
    return int(struct.unpack_from("<H", data)[0])


def _unpack(layout: struct.Struct, data: bytes) -> tuple:
    if len(data) != layout.size:
        raise LivoxWireError(PacketRefusal.LENGTH, f"{layout.size} bytes were expected, {len(data)} arrived.")
    return layout.unpack(data)
