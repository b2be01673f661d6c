"""The lidar's clock in ours: the smallest delay wins, drift is followed, a clock that was set is noticed."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.livox.host_time import HostTime

SECOND = 1_000_000_000
ZERO = 1_700_000_000 * SECOND


def test_delay_does_not_move_the_stamps() -> None:
    time = HostTime()
    for index, delay in enumerate(np.random.default_rng(0).integers(200_000, 40_000_000, 2000)):
        assert not time.observe(index * 10_000_000, ZERO + index * 10_000_000 + int(delay))
    assert abs(time.to_host(0) - ZERO) < 2_000_000


def test_drift_is_followed() -> None:
    time = HostTime()
    for tenth in range(6000):
        device_ns = tenth * SECOND // 10
        time.observe(device_ns, ZERO + device_ns + device_ns * 50 // 1_000_000)
    assert abs(time.to_host(599 * SECOND) - (ZERO + 599 * SECOND + 599 * 50_000)) < 1_000_000


@pytest.mark.parametrize(
    "device_ns",
    [0, 90_000 * SECOND, 500 * SECOND - 37 * SECOND, 538 * SECOND, 500 * SECOND - 2_000_000],
    ids=["restarted", "took PTP time", "left TAI for UTC", "took TAI", "slewed"],
)
def test_a_clock_that_was_set_is_told_and_followed_at_once(device_ns: int) -> None:
    time = HostTime()
    assert not time.observe(500 * SECOND, ZERO)
    assert time.observe(device_ns, ZERO + SECOND)
    assert time.to_host(device_ns) == ZERO + SECOND


def test_another_time_source_is_another_clock_though_it_tells_nearly_the_same() -> None:
    time = HostTime()
    time.observe(500 * SECOND, ZERO, source=0)
    assert time.observe(500 * SECOND + 480_000, ZERO + 480_000, source=1)


def test_packets_that_a_receiver_which_stood_still_reads_at_once_are_as_old_as_they_are() -> None:
    """1.5 s of backlog."""
    time = HostTime()
    for tick in range(400):
        time.observe(tick * 10_000_000, ZERO + tick * 10_000_000)
    for tick in range(400, 550):
        assert not time.observe(tick * 10_000_000, ZERO + 5_500_000_000)
        assert time.to_host(tick * 10_000_000) == ZERO + tick * 10_000_000


def test_delay_that_stays_is_believed_after_a_window() -> None:
    time = HostTime()
    time.observe(0, ZERO)
    for tick in range(1, 1200):
        time.observe(tick * 10_000_000, ZERO + tick * 10_000_000 + 2 * SECOND)
    assert time.to_host(0) == ZERO + 2 * SECOND


def test_before_the_first_packet_there_is_no_time() -> None:
    with pytest.raises(ValueError, match="clock is unknown"):
        HostTime().to_host(0)
