"""The small parts: what is news, two sensors as one IMU, two clocks as one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivers.realsense.gate import DuplicateFilter
from drivers.realsense.imu import ImuPairing
from drivers.realsense.messages import ImagePair, Motion, TimestampDomain
from drivers.realsense.time import WINDOW_NS, DeviceTime, WallTime

MS = 1_000_000
GLOBAL = TimestampDomain.GLOBAL


def pair(number: int, seed: int | None = None) -> ImagePair:
    rng = np.random.default_rng(number if seed is None else seed)
    color = rng.integers(0, 255, (48, 64, 3), np.uint8)
    return ImagePair(
        color, rng.integers(500, 900, (48, 64), np.uint16), number, number, number * 33 * MS, number * 33 * MS, GLOBAL
    )


def test_new_images_are_news_and_missing_numbers_are_counted() -> None:
    gate = DuplicateFilter()
    assert [gate.admit(pair(n)) for n in (1, 2, 5)] == [True] * 3
    assert (gate.frames, gate.lost, gate.frozen) == (3, 2, 0)


@pytest.mark.parametrize(
    "frozen",
    [
        pair(1),
        replace(pair(2), color_number=1),
        replace(pair(2), depth_number=1),
        replace(pair(2), device_stamp_ns=33 * MS),
        replace(pair(2), depth_device_stamp_ns=33 * MS),
        replace(pair(2), color=pair(1).color),
        replace(pair(2), depth=pair(1).depth),
    ],
    ids=["everything", "color number", "depth number", "color stamp", "depth stamp", "color pixels", "depth pixels"],
)
def test_anything_that_stands_still_is_frozen(frozen) -> None:
    gate = DuplicateFilter()
    gate.admit(pair(1))
    assert not gate.admit(frozen)
    assert gate.frozen == 1
    assert gate.admit(pair(3))


def test_a_blank_image_is_dark_not_frozen() -> None:
    gate = DuplicateFilter()
    black = np.zeros((48, 64, 3), np.uint8)
    assert all(gate.admit(replace(pair(n), color=black)) for n in (1, 2, 3))


def motion(kind: str, ms: float, x: float) -> Motion:
    return Motion(kind, round(ms * MS), GLOBAL, (x, 2 * x, 0.0))


def test_acceleration_is_interpolated_to_the_gyroscope() -> None:
    pairing = ImuPairing()
    assert pairing.add(motion("accel", 0, 0.0)) == []
    assert pairing.add(motion("gyro", 3, 9.0)) == []
    [(gyro, acceleration)] = pairing.add(motion("accel", 4, 8.0))
    assert gyro.value[0] == 9.0
    assert acceleration == pytest.approx([6.0, 12.0, 0.0])


def test_a_gyroscope_sample_before_the_first_acceleration_is_left_out() -> None:
    pairing = ImuPairing()
    pairing.add(motion("gyro", 1, 1.0))
    pairing.add(motion("accel", 2, 1.0))
    pairing.add(motion("gyro", 3, 3.0))
    assert [gyro.value[0] for gyro, _ in pairing.add(motion("accel", 4, 1.0))] == [3.0]


def test_the_smallest_delay_counts() -> None:
    time = DeviceTime()
    for sent_ms, delay_ms in ((0, 9), (33, 2), (66, 7)):
        time.observe(sent_ms * MS, (1000 + sent_ms + delay_ms) * MS)
    assert time.to_ours(66 * MS) == (1000 + 66 + 2) * MS


def test_a_message_that_comes_two_seconds_late_is_two_seconds_old() -> None:
    time = DeviceTime()
    time.observe(0, 1000 * MS)
    time.observe(33 * MS, 3033 * MS)
    assert time.to_ours(33 * MS) == 1033 * MS


def test_a_clock_that_drifts_away_is_followed() -> None:
    time, start = DeviceTime(), 1000 * MS
    for ms in range(0, 60_000, 33):
        time.observe(ms * MS, start + ms * MS + ms * 50)  # 50 ppm
    age_ns = start + ms * MS + ms * 50 - time.to_ours(ms * MS)
    assert 0 <= age_ns <= 2 * WINDOW_NS * 50e-6 + MS


def test_before_anything_arrived_the_clock_is_unknown() -> None:
    with pytest.raises(ValueError, match="unknown"):
        DeviceTime().to_ours(0)


class Hands:
    """Our clock and the wall's, moved by hand; each reading of ours takes `slow_ns`."""

    def __init__(self) -> None:
        self.ours_ns, self.wall, self.slow_ns = 50 * MS, 9_000 * MS, 0

    def now_ns(self) -> int:
        self.ours_ns += self.slow_ns
        return self.ours_ns

    def sleep(self, seconds: float) -> None:
        self.ours_ns, self.wall = self.ours_ns + round(seconds * 1e9), self.wall + round(seconds * 1e9)


def test_wall_stamps_keep_their_distances_and_follow_a_step() -> None:
    hands = Hands()
    time = WallTime(hands, lambda: hands.wall)
    assert time.to_ours(8_990 * MS) == 40 * MS
    hands.sleep(1)
    hands.wall += MS  # the error of a reading: the stamps stay evenly spaced
    assert time.to_ours(9_990 * MS) == 1_040 * MS
    hands.wall -= 3_600_000 * MS  # an hour's step: stamps of the new time are as young as they were
    assert time.to_ours(hands.wall - 10 * MS) == hands.ours_ns - 10 * MS


def test_an_interrupted_reading_changes_nothing() -> None:
    hands = Hands()
    time = WallTime(hands, lambda: hands.wall)
    time.to_ours(9_000 * MS)
    hands.slow_ns = 30 * MS
    assert time.to_ours(9_000 * MS) == 50 * MS
