"""What is under way when a test of failures begins."""

from __future__ import annotations

import pytest

from openbelief.pose import Pose2


@pytest.fixture
def under_way(rig):
    """A robot that has been driving for a second."""
    rig.nav.send(Pose2(3.5, 3.0, 1.0))
    rig.clock.sleep(1.0)
    assert rig.robot.moving
    return rig
