"""Links that are killed, cut or left, on real sessions (failure modes 1, 2, 6, 7 and 14 of docs/nav2.md)."""

from __future__ import annotations

import subprocess
import sys

import pytest

from drivers.nav2.limits import Nav2Limits
from drivers.ports import LinkLost, NavigationStatus
from drivers.ros.zenoh_link import LinkConfig, ZenohLink, open_router
from openbelief.pose import Pose2

GOAL = Pose2(3.5, 3.0, 1.0)
USE_THE_REMOTE = "use the remote"


# 1, 2: links


def test_a_killed_bridge_is_named_and_the_operator_warned(under_way):
    under_way.graph.bridge.close()
    result = under_way.until_end(within_s=10.0)
    assert result.status == NavigationStatus.STILL_MOVING
    assert "bridge" in result.reason and USE_THE_REMOTE in result.reason


def test_a_query_to_a_killed_bridge_ends_at_once(under_way, eventually):
    under_way.graph.bridge.close()
    with pytest.raises(LinkLost, match="planner does not answer: nobody answered"):  # not "in time": it did not wait
        under_way.nav.plan(GOAL)
    eventually(lambda: "zenoh-bridge-ros2dds" in (under_way.nav.unavailable() or ""))


def test_a_silent_link_is_noticed_within_the_bridges_lease(silent_wire, eventually):
    with open_router(lease_s=0.5) as endpoint:
        wire = silent_wire(endpoint)
        with ZenohLink(LinkConfig((wire.endpoint,))) as link:
            assert link.alive
            wire.cut()
            eventually(lambda: not link.alive)
            wire.refuse()


def test_a_silent_link_never_hangs_a_plan_or_a_cancel(make_rig, silent_wire):
    wires = []

    def through(endpoint):
        wires.append(silent_wire(endpoint))
        return wires[0].endpoint

    rig = make_rig(through=through)
    rig.start()
    rig.nav.send(GOAL)
    wires[0].cut()
    with pytest.raises(LinkLost):
        rig.nav.plan(GOAL)
    assert rig.nav.cancel(because="the operator said stop").status == NavigationStatus.STILL_MOVING
    wires[0].refuse()


# 6: no deadman in Zenoh


def test_the_robot_drives_on_when_the_workstation_dies(under_way):
    """Not a promise but a warning: the watchdog on the robot (openbelief onboard) is what stops it."""
    under_way.link.close()
    under_way.clock.sleep(1.0)
    assert under_way.robot.moving
    result = under_way.nav.cancel(because="the link is closed")
    assert result.status == NavigationStatus.STILL_MOVING and USE_THE_REMOTE in result.reason


# 7: reconnection


def test_after_a_reconnection_the_goals_end_is_still_learned(make_rig, silent_wire, eventually):
    wires = []

    def through(endpoint):
        wires.append(silent_wire(endpoint))
        return wires[0].endpoint

    rig = make_rig(through=through, limits=Nav2Limits(silence_s=60.0))
    rig.start()
    rig.nav.send(GOAL)
    wires[0].refuse()
    eventually(lambda: not rig.link.alive)
    rig.clock.sleep(30.0)  # the robot arrives unwatched
    assert rig.nav.result() is None
    wires[0].mend()
    eventually(lambda: rig.nav.result() is not None)
    assert rig.nav.result().status == NavigationStatus.SUCCEEDED


# 14: processes and ports


def test_a_process_with_an_open_link_ends_on_sigterm():
    code = (
        "import sys, threading\n"
        "from drivers.ros.zenoh_link import LinkConfig, ZenohLink, open_router\n"
        "with open_router() as endpoint, ZenohLink(LinkConfig((endpoint,))) as link:\n"
        "    link.subscribe('tf', print)\n"
        "    print('open', flush=True)\n"
        "    threading.Event().wait()\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline().strip() == "open"
        process.terminate()
        process.wait(timeout=5.0)


def test_two_routers_get_two_ports():
    with open_router() as one, open_router() as other:
        assert one != other
