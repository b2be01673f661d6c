"""The lidar's health codes (HMS, key 0x8011) as words an operator can act on."""

from __future__ import annotations

import struct
from typing import NamedTuple

LEVELS = {1: "info", 2: "warning", 3: "error", 4: "fatal"}

# (first id, last id, what it means, what to do)
TABLE = (
    (
        0x0102,
        0x0103,
        "the temperature is outside the working range",
        "shade or ventilate the lidar, or let it warm up",
    ),
    (0x0104, 0x0104, "the window is dirty", "clean the window with a soft cloth"),
    (0x0113, 0x0113, "the IMU inside the lidar has stopped", "power-cycle the lidar; if it returns, have it serviced"),
    (0x0210, 0x0219, "the scan module has a fault", "power-cycle the lidar; if it returns, have it serviced"),
    (0x0401, 0x0401, "the network link dropped", "check the cable, the plug and the switch"),
    (0x0402, 0x040A, "time synchronisation has a fault", "check the PTP or GPS source"),
)


class HealthCode(NamedTuple):
    """One active code. `str()` is the operator's sentence."""

    id: int
    level: str
    words: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.level}: {self.words} (HMS {self.id:04X}); {self.remedy}."


def health_code(raw: int) -> HealthCode:
    """A u32 from the wire: bytes 3:2 are the id, byte 0 the level. An id outside the table is shown, never hidden."""
    number = raw >> 16
    level = LEVELS.get(raw & 0xFF, f"level {raw & 0xFF}")
    for first, last, words, remedy in TABLE:
        if first <= number <= last:
            return HealthCode(number, level, words, remedy)
    return HealthCode(number, level, "a code this program does not know", "look it up in the lidar's manual")


def parse_health(value: bytes) -> tuple[HealthCode, ...]:
    """The active codes of the key's u32[8]; zeros are empty places."""
    return tuple(health_code(raw) for (raw,) in struct.iter_unpack("<I", value[: len(value) // 4 * 4]) if raw)
