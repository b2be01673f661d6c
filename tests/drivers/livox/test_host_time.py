"""The lidar's clock in ours: the smallest delay wins, drift is followed, a restart is noticed."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.livox.host_time import HostTime

SECOND = 1_000_000_000
ZERO = 1_700_000_000 * SECOND


def test_delay_does_not_move_the_stamps() -> None:
    time = HostTime()
    for index, delay in enumerate(np.random.default_rng(0).integers(200_000, 40_000_000, 2000)):
        time.observe(index * 10_000_000, ZERO + index * 10_000_000 + int(delay))
    assert abs(time.to_host(0) - ZERO) < 2_000_000


def test_drift_is_followed() -> None:
    time = HostTime()
    for tenth in range(6000):
        device_ns = tenth * SECOND // 10
        time.observe(device_ns, ZERO + device_ns + device_ns * 50 // 1_000_000)
    assert abs(time.to_host(599 * SECOND) - (ZERO + 599 * SECOND + 599 * 50_000)) < 1_000_000


@pytest.mark.parametrize("device_ns", [0, 90_000 * SECOND], ids=["restarted", "took PTP time"])
def test_a_step_of_the_lidars_clock_is_followed_at_once(device_ns: int) -> None:
    time = HostTime()
    time.observe(500 * SECOND, ZERO)
    time.observe(device_ns, ZERO + SECOND)
    assert time.to_host(device_ns) == ZERO + SECOND


def test_before_the_first_packet_there_is_no_time() -> None:
    with pytest.raises(ValueError, match="clock is unknown"):
        HostTime().to_host(0)
