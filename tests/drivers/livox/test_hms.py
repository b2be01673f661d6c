"""Health codes as an operator reads them."""

from __future__ import annotations

import struct

import pytest

from drivers.livox.hms import health_code, parse_health


@pytest.mark.parametrize(
    ("raw", "level", "word"),
    [
        (0x01040002, "warning", "window"),
        (0x01020001, "info", "temperature"),
        (0x01130003, "error", "IMU"),
        (0x02150004, "fatal", "scan module"),
        (0x04010003, "error", "network link"),
        (0x040A0002, "warning", "time synchronisation"),
    ],
)
def test_a_code_is_told_with_its_level_and_a_remedy(raw: int, level: str, word: str) -> None:
    code = health_code(raw)
    assert code.level == level
    assert word in code.words
    assert f"{raw >> 16:04X}" in str(code)
    assert code.remedy in str(code)


def test_an_unknown_code_is_shown_with_its_number() -> None:
    assert "7777" in str(health_code(0x77770009))
    assert "level 9" in str(health_code(0x77770009))


def test_only_active_codes_are_listed() -> None:
    codes = parse_health(struct.pack("<8I", 0, 0x01040002, 0, 0x01130003, 0, 0, 0, 0))
    assert [code.id for code in codes] == [0x0104, 0x0113]
