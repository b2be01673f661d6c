"""Two servers of one action: no drive, and where one is under way both are told to stop (failure mode 12)."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from drivers.ports import LinkLost, NavigationStatus
from drivers.ros.action import EXECUTING
from drivers.ros.messages import codec
from drivers.topics import NAVIGATE_TO_POSE
from openbelief.pose import Pose2
from sim_fakes.wire.nav2_messages import Nav2Messages, ServedGoal
from sim_fakes.wire.nav2_server import SimNav2Server
from sim_fakes.wire.sim_bridge import SimBridge
from sim_fakes.world.robot import SimRobot

GOAL = Pose2(3.5, 3.0, 1.0)


@pytest.fixture
def second(rig):
    """Another Nav2 with a robot of its own, behind another bridge; `start()` brings it up."""
    with SimBridge(rig.link.config.endpoints[0]) as bridge:
        robot = SimRobot(rig.room, rig.clock, Pose2(1.0, 1.0, 0.0))
        server = SimNav2Server(bridge, rig.clock, robot, rig.room.occupancy_grid())
        yield SimpleNamespace(bridge=bridge, robot=robot, server=server, start=server.start)


def test_two_servers_are_refused_before_a_drive(rig, second, eventually):
    second.start()
    eventually(lambda: "2 Nav2 servers" in (rig.nav.unavailable() or ""))
    with pytest.raises(LinkLost, match="2 servers answered"):
        rig.nav.plan(GOAL)


def test_a_goal_that_two_servers_took_is_cancelled_at_both(rig, second, eventually):
    second.start()
    eventually(lambda: rig.nav.readiness.doubled)
    result = rig.nav.send(GOAL)
    assert result.status == NavigationStatus.LOST and "2 Nav2 servers" in result.reason
    rig.clock.sleep(0.5)
    assert rig.graph.nav2.accepted == second.server.accepted == 1
    assert not rig.robot.moving and not second.robot.moving


def test_a_second_server_that_comes_under_way_ends_the_drive(under_way, second, eventually):
    second.start()
    eventually(lambda: under_way.nav.result() is not None)
    assert under_way.nav.result().status == NavigationStatus.LOST and "2 Nav2 servers" in under_way.nav.result().reason
    assert not under_way.robot.moving


def test_two_servers_behind_one_bridge_are_told_by_the_two_moments_of_their_acceptance(under_way):
    rig, uuid = under_way, under_way.nav._goal.uuid
    other = Nav2Messages(codec()).statuses([ServedGoal(uuid, None, 12_000_000_034, status=EXECUTING)])
    rig.graph.bridge.put(rig.graph.bridge.keys.action(NAVIGATE_TO_POSE, "status"), codec().encode(other), latched=True)
    rig.graph.bridge.flush()
    result = rig.until_end()
    assert result.status == NavigationStatus.LOST and "2 Nav2 servers" in result.reason
    assert not rig.robot.moving


def test_a_server_that_refuses_the_cancel_is_not_outvoted_by_one_that_takes_it(rig, second, eventually):
    second.start()
    eventually(lambda: rig.nav.readiness.doubled)
    second.server.faults.cancel_code = 1
    assert rig.nav.halt(because="stop").status == NavigationStatus.STILL_MOVING
