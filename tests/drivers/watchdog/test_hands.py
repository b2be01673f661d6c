"""The watchdog's second way to Nav2, on DDS: real participants on loopback, one of which plays Nav2."""

from __future__ import annotations

import itertools
import sys
from contextlib import ExitStack, contextmanager
from types import SimpleNamespace

import pytest

from drivers.dds.action import without_header
from drivers.dds.raw import DdsPeer, DdsUnavailable, dds_installed, ros_domain
from drivers.ros import action
from drivers.ros.zenoh_link import ZenohLink
from drivers.watchdog.guard import WatchdogGuard
from drivers.watchdog.heartbeat import Heartbeat, WatchdogView
from drivers.watchdog.latch import BRIDGE_GONE, WatchdogState
from robot_app.benches.programs import own_dds

with_dds = pytest.mark.skipif(not dds_installed(), reason="cyclonedds has no wheel for this machine")
DOMAINS = itertools.count(60)


@pytest.fixture
def dds(monkeypatch):
    """`dds.hand()` and `dds.nav2()`: the watchdog's hand and a Nav2, each a participant of its own in one domain."""
    from drivers.watchdog.hands import DdsHand
    from sim_fakes.wire.dds_nav2 import DdsNav2

    monkeypatch.setenv("CYCLONEDDS_URI", own_dds()["CYCLONEDDS_URI"])
    domain = next(DOMAINS)
    with ExitStack() as opened:

        def peer() -> DdsPeer:
            return opened.enter_context(DdsPeer(domain))

        yield SimpleNamespace(hand=lambda: DdsHand(peer()), nav2=lambda: DdsNav2(peer()))


@contextmanager
def watched(rig, hand):
    """A watchdog with that hand, and a workstation that beats and listens, both on the rig's router."""
    with ZenohLink(rig.link.config) as link:
        guard, view = WatchdogGuard(link, hand=hand), WatchdogView(rig.link)
        guard.start()
        view.start()
        with Heartbeat(rig.link):
            yield guard, view


def heard(hand, *servers) -> list:
    for server in servers:
        server.step()
    return hand.hear()


@with_dds
def test_every_goal_is_cancelled_on_dds_and_the_answer_is_heard(dds, eventually):
    hand, nav2 = dds.hand(), dds.nav2()
    nav2.drive()
    eventually(lambda: heard(hand, nav2) == [] and hand.servers == 1 and hand.driving)
    hand.cancel_all(7)
    answers: list = []
    eventually(lambda: answers.extend(heard(hand, nav2)) or answers)
    assert [(a.trip, a.code) for a in answers] == [(7, action.CANCEL_OK)]
    assert [every for _, every in nav2.cancels] == [True]
    eventually(lambda: heard(hand, nav2) == [] and not hand.driving)


@with_dds
def test_two_servers_must_both_answer_and_a_refusal_counts(dds, eventually):
    hand, one, other = dds.hand(), dds.nav2(), dds.nav2()
    eventually(lambda: hand.servers == 2)
    other.mute = True
    hand.cancel_all(1)
    eventually(lambda: heard(hand, one, other) == [] and one.cancels and other.cancels)
    other.mute, other.refuses = False, True
    hand.cancel_all(2)
    answers: list = []
    eventually(lambda: answers.extend(heard(hand, one, other)) or answers)
    assert [(a.trip, a.code) for a in answers] == [(2, action.CANCEL_REJECTED)]


@with_dds
def test_answers_to_others_and_bytes_that_are_none_are_ignored(dds, eventually):
    hand, nav2 = dds.hand(), dds.nav2()
    eventually(lambda: hand.servers == 1)
    hand.cancel_all(1)
    for payload in (b"\x00\x01\x00\x00" + bytes(16), b"\x00\x01\x00\x00" + b"\xff" * 60):
        nav2._replies.write(payload)
        nav2._statuses.write(payload)
    answers: list = []
    eventually(lambda: answers.extend(heard(hand, nav2)) or answers)
    assert len(answers) == 1 and not hand.driving


@with_dds
def test_a_bridge_that_ends_under_way_is_a_reason_to_stop_and_the_cancel_needs_no_bridge(rig, dds, eventually):
    hand, nav2 = dds.hand(), dds.nav2()
    nav2.drive()
    with watched(rig, hand) as (guard, view):

        def step() -> WatchdogState:
            nav2.step()
            guard.step()
            return guard.status.state

        eventually(lambda: step() is WatchdogState.ARMED and hand.driving)
        rig.graph.bridge.close()  # the workstation still beats: the router is another process
        eventually(lambda: step() is WatchdogState.LATCHED)
        assert guard.status.reason == BRIDGE_GONE
        eventually(lambda: bool(step()) and guard.status.acknowledged)
        assert nav2.cancels and nav2.goal.status != action.EXECUTING
        eventually(lambda: bool(step()) and not hand.driving)
        assert view.reset().ok
        assert (guard.status.hand, guard.status.hand_servers) == ("cyclonedds", 1)


@with_dds
def test_two_servers_behind_one_bridge_are_refused_before_a_drive(rig, dds, eventually):
    hand, _one, _other = dds.hand(), dds.nav2(), dds.nav2()
    with watched(rig, hand) as (guard, view):
        eventually(lambda: bool(guard.step() or True) and "2 Nav2 servers" in (view.trouble() or ""))


def test_a_request_without_a_header_is_none():
    assert without_header(b"\x00\x01\x00\x00 too short") is None


def test_a_domain_that_is_no_number_is_refused(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "many")
    with pytest.raises(DdsUnavailable, match="0 to 232"):
        ros_domain()


# The helper under ROS, as far as its lines go (tests/ros_peer has the real one)

ECHO = """
import json, sys
print(json.dumps({"servers": 1, "driving": True}), flush=True)
print("no line of ours", flush=True)
print("[" * 900, flush=True)
print('{"trip": "x"}', flush=True)
print("7", flush=True)
for line in sys.stdin:
    print(json.dumps({"trip": int(line.split()[1]), "code": 0}), flush=True)
"""


def test_a_helper_under_ros_is_a_hand_as_well(eventually, caplog):
    from drivers.watchdog.ros_hand import RosHelperHand

    with RosHelperHand([sys.executable, "-c", ECHO]) as hand:
        eventually(lambda: hand.servers == 1 and hand.driving)
        hand.cancel_all(3)
        answers: list = []
        eventually(lambda: answers.extend(hand.hear()) or answers)
        assert [(a.trip, a.code) for a in answers] == [(3, 0)]
    assert hand.servers == 0
    assert "was ignored (4 so far)" in caplog.text


def test_a_helper_that_ended_is_unavailable_and_says_so(eventually):
    from drivers.watchdog.ros_hand import RosHelperHand

    with RosHelperHand([sys.executable, "-c", "pass"]) as hand:
        hand._process.wait()

        def refused() -> bool:
            try:
                hand.cancel_all(1)
            except DdsUnavailable:
                return True
            return False

        eventually(refused)
        assert hand.servers == 0


def test_a_helper_that_is_not_there_is_named():
    from drivers.watchdog.ros_hand import RosHelperHand

    with pytest.raises(DdsUnavailable, match="cannot be started"), RosHelperHand(["/no/such/python"]):
        pass
