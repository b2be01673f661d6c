"""The MID-360's parameter keys, and its states and return codes as words."""

from __future__ import annotations

from enum import IntEnum


class Key(IntEnum):
    """Below 0x8000 writable, from there read-only."""

    DATA_TYPE = 0x0000
    PATTERN = 0x0001
    LIDAR_IP = 0x0004
    STATE_DESTINATION = 0x0005
    POINTS_DESTINATION = 0x0006
    IMU_DESTINATION = 0x0007
    ATTITUDE = 0x0012  # stored by the lidar, not applied to its points
    WORK_MODE = 0x001A
    IMU_ENABLE = 0x001C
    SERIAL = 0x8000
    PRODUCT = 0x8001
    APP_VERSION = 0x8002
    LOADER_VERSION = 0x8003
    HARDWARE_VERSION = 0x8004
    STATE = 0x8006
    CORE_TEMPERATURE = 0x8007
    DIAGNOSIS = 0x800E
    FIRMWARE_TYPE = 0x8010  # 1 the application; the vendor's SDK asks for it before anything else
    HMS = 0x8011


READ_ONLY_FROM = 0x8000
SAMPLING = 1

STATES = {
    1: "sampling",
    2: "idle",
    4: "error",
    5: "self-check",
    6: "motor starting",
    8: "upgrading",
    9: "ready",
}
RETURN_CODES = {
    0: "done",
    1: "failed",
    2: "not permitted now",
    3: "value out of range",
    0x20: "key not supported",
    0x21: "takes effect after a reboot",
    0x22: "key is read-only",
    0x23: "wrong value length",
    0x24: "wrong number of keys",
}


def word(table: dict[int, str], value: int) -> str:
    """The word for a number, or the number itself where the table has none."""
    return table.get(value, f"unknown ({value:#x})")
