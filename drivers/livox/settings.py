"""Where the MID-360 is, where its packets go, and what may be changed of it."""

from __future__ import annotations

import dataclasses
import ipaddress
from typing import Annotated

from pydantic import AfterValidator
from pydantic.dataclasses import dataclass

from openbelief.settings import CHECKED, Flag, in_one_line


def _ipv4(address: str) -> str:
    try:
        ipaddress.IPv4Address(address)
    except ValueError as error:
        raise ValueError(f"an IPv4 address like 192.168.123.120 is needed, not {address!r}") from error
    return address


Address = Annotated[str, AfterValidator(_ipv4)]


@in_one_line("Lidar setting")
@dataclass(frozen=True, kw_only=True, config=CHECKED)
class LivoxSettings:
    """The lidar's address and this machine's, as the G1 has them. take_control: send its packets here.

    Raises ValueError on an address that is none.
    """

    lidar_ip: Address = "192.168.123.120"
    host_ip: Address = "192.168.123.164"
    frame_id: str = "livox_frame"
    take_control: Flag = False


@dataclasses.dataclass(frozen=True, kw_only=True)
class LivoxPorts:
    """UDP ports, the factory's. Those of this machine may be 0: any free one."""

    points: int = 56301
    imu: int = 56401
    push: int = 56201
    command: int = 56101
    lidar_command: int = 56100
    lidar_points: int = 56300
    lidar_imu: int = 56400
    lidar_push: int = 56200
