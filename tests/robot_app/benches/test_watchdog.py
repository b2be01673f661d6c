"""The watchdog with real processes, once per way of losing the workstation; the bench repeats it and takes times."""

from __future__ import annotations

import signal
from contextlib import ExitStack

import pytest

from drivers.dds.raw import dds_installed
from drivers.watchdog.latch import BRIDGE_GONE
from robot_app.benches.programs import Program, until
from robot_app.benches.watchdog import LOSSES, watched_robot


@pytest.mark.parametrize("loss", sorted(LOSSES))
def test_a_lost_workstation_is_cancelled_at_nav2_by_a_process_of_its_own(loss):
    if loss == "bridge killed" and not dds_installed():
        pytest.skip("cyclonedds has no wheel for this machine")
    with watched_robot() as bench:
        result = bench.measure(loss, 1)
    assert result["runs"] == 1 and result["times_s"][0] > 0.0  # after the loss; how soon, the bench itself judges


@pytest.mark.skipif(not dds_installed(), reason="cyclonedds has no wheel for this machine")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_bridge_that_is_started_again_at_once_in_mid_drive_stops_the_robot_too(number):
    """As systemd does it: the goal of before is one that nobody could have stopped."""
    with watched_robot() as bench, ExitStack() as opened:
        bench.dds.type("drive")
        bench.dds.expect("driving")
        Program(opened, "sim_fakes.wire.workstation_process", bench.wire.endpoint).expect("driving")
        until("a watchdog that watches", lambda: bench._state() == "armed")
        bench.nav2.signal(number)
        bench.nav2.wait()
        bench._mend()
        assert bench.dds.expect("cancel_ns")["all"]
        until("a latch", lambda: bench._state() == "latched")
        assert bench._view.status.reason == BRIDGE_GONE
        until("a reset", lambda: bench._view.reset().ok)
