"""The watchdog with real processes, once per way of losing the workstation; the bench repeats it and takes times."""

from __future__ import annotations

import pytest

from drivers.dds.raw import dds_installed
from robot_app.benches.watchdog import LOSSES, watched_robot


@pytest.mark.parametrize("loss", sorted(LOSSES))
def test_a_lost_workstation_is_cancelled_at_nav2_by_a_process_of_its_own(loss):
    if loss == "bridge killed" and not dds_installed():
        pytest.skip("cyclonedds has no wheel for this machine")
    with watched_robot() as bench:
        result = bench.measure(loss, 1)
    assert 0.0 < result["worst_s"] < 2.0  # on a machine that does nothing else: 0.75
