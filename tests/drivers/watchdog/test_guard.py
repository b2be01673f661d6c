"""The watchdog's ears and hands on real sessions, its time moved by hand; the simulated Nav2 behind the same router."""

from __future__ import annotations

import threading
from contextlib import ExitStack
from dataclasses import dataclass

import pytest

from drivers.ports import LinkLost, PortError
from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.zenoh_link import ZenohLink
from drivers.watchdog.guard import WORKSTATIONS_MAX, WatchdogGuard
from drivers.watchdog.heartbeat import Heartbeat, WatchdogView
from drivers.watchdog.latch import WatchdogState
from drivers.watchdog.wire import STATUS_MAX_BYTES, HeartbeatMessage, WatchdogKeys, packed
from openbelief.pose import Pose2

FAR = Pose2(5.0, 1.0, 0.0)


@dataclass
class Deadman:
    """A rig whose Nav2 drives, with a guard that has its own session and a time of its own."""

    guard: WatchdogGuard
    view: WatchdogView
    now_s: float = 100.0

    def step(self, seconds: float = 0.0) -> WatchdogState:
        self.now_s += seconds
        self.guard.step()
        return self.guard.status.state

    def tell(self) -> None:
        """The status once more, though no time passes."""
        self.guard._told = None
        self.guard.step()


@pytest.fixture
def deadman(rig):
    with ExitStack() as opened:
        link = opened.enter_context(ZenohLink(rig.link.config))
        link.subscribe("broken", lambda payload: 1 / len(payload))  # before the heartbeat's, so it is known by then
        made = Deadman(None, WatchdogView(rig.link))  # type: ignore[arg-type]
        made.guard = WatchdogGuard(link, now_ns=lambda: round(made.now_s * 1e9))
        made.guard.start()
        made.view.start()
        yield made


def test_a_workstation_that_falls_silent_stops_the_robot_and_a_person_resets_it(rig, deadman, eventually):
    with Heartbeat(rig.link) as heartbeat:
        eventually(lambda: deadman.step() is WatchdogState.ARMED)
        assert rig.nav.send(FAR) is None
        rig.clock.sleep(1.0)
        assert rig.robot.moving
        heartbeat.abandon()
        assert deadman.step(1.0) is WatchdogState.LATCHED
        eventually(lambda: deadman.step() is WatchdogState.LATCHED and deadman.guard.status.acknowledged)
        assert not rig.robot.moving
        eventually(lambda: bool(deadman.step(0.3)) and deadman.view.trouble() is not None)
        assert "latched" in deadman.view.trouble() and "silent" in deadman.view.trouble()
        eventually(lambda: deadman.view.reset().ok)
        assert deadman.step() is WatchdogState.WAITING
        assert not rig.robot.moving
        eventually(lambda: bool(deadman.step(0.3)) and "does not hear" in (deadman.view.trouble() or ""))
        heartbeat.resume()
        eventually(lambda: deadman.step() is WatchdogState.ARMED and deadman.view.trouble() is None)


def test_a_goal_that_somebody_sends_though_latched_is_cancelled(rig, deadman, eventually):
    with Heartbeat(rig.link) as heartbeat:
        eventually(lambda: deadman.step() is WatchdogState.ARMED)
        heartbeat.abandon()
        deadman.step(1.0)
        eventually(lambda: deadman.step() is WatchdogState.LATCHED and deadman.guard.status.acknowledged)
        assert rig.nav.send(FAR) is None
        eventually(lambda: bool(deadman.step(0.3)) and not rig.robot.moving)


def test_a_reset_is_refused_while_nav2_has_not_acknowledged(rig, deadman, eventually):
    rig.graph.nav2_faults.cancel_code = 1  # rejected
    with Heartbeat(rig.link) as heartbeat:
        eventually(lambda: deadman.step() is WatchdogState.ARMED)
        heartbeat.abandon()
        deadman.step(1.0)
        reply = deadman.view.reset()
        assert not reply.ok and "remote" in reply.reason
        rig.graph.nav2_faults.cancel_code = None
        eventually(lambda: bool(deadman.step(0.3)) and deadman.view.reset().ok)


@pytest.mark.parametrize("answer", [b"", b"garbage", b"\xff\xfe", b"{}", b'{"ok": "maybe"}', b"[" * 5000, b"x" * 9000])
def test_a_garbage_answer_to_a_reset_is_one_sentence_and_no_reset(rig, eventually, answer):
    view, said = WatchdogView(rig.link, BridgeKeys()), []

    def answered() -> bool:
        """Until the stranger's offer to answer has come through the router, nobody does."""
        with pytest.raises(PortError) as refused:
            view.reset()
        said.append(str(refused.value))
        return "does not answer" not in said[-1]

    with ZenohLink(rig.graph.link_config) as stranger:
        stranger.answer(WatchdogKeys(BridgeKeys()).reset, lambda _: answer)
        eventually(answered)
    assert "may still be latched" in said[-1] and "\n" not in said[-1]


def test_a_heart_whose_link_once_refused_a_beat_can_be_made_to_beat_again(rig, deadman, eventually, monkeypatch):
    def refuse(*_: object, **__: object) -> None:
        raise LinkLost("The Zenoh link is closed.")

    with Heartbeat(rig.link) as heartbeat:
        eventually(lambda: deadman.step() is WatchdogState.ARMED)
        with monkeypatch.context() as broken:
            broken.setattr(rig.link, "put", refuse)
            eventually(lambda: not any(t.name == "heartbeat" for t in threading.enumerate()))
        assert deadman.step(1.0) is WatchdogState.LATCHED
        eventually(lambda: bool(deadman.step(0.3)) and deadman.view.reset().ok)
        heartbeat.resume()
        eventually(lambda: deadman.step() is WatchdogState.ARMED)


def test_a_late_answer_to_an_earlier_trip_acknowledges_nothing(rig, deadman, eventually, caplog):
    with Heartbeat(rig.link) as heartbeat:
        eventually(lambda: deadman.step() is WatchdogState.ARMED)
        heartbeat.abandon()
        rig.graph.nav2_faults.slow_s = 0.5  # the answer to the first trip's second cancel comes after the reset
        deadman.step(1.0)
        deadman.step(0.3)
        eventually(lambda: deadman.guard.status.acknowledged and deadman.view.reset().ok)
        rig.graph.nav2_faults.cancel_code = 1  # from now on cancels are refused
        heartbeat.resume()
        eventually(lambda: deadman.step() is WatchdogState.ARMED)
        heartbeat.abandon()
        assert deadman.step(1.0) is WatchdogState.LATCHED
        eventually(lambda: bool(deadman.step(0.3)) and "the cancel was not taken" in caplog.text)
        assert not deadman.guard.status.acknowledged


def test_a_handler_that_fails_does_not_keep_the_watchdog_from_cancelling(rig, deadman, eventually, caplog):
    with Heartbeat(rig.link) as heartbeat:
        eventually(lambda: deadman.step() is WatchdogState.ARMED)
        assert rig.nav.send(FAR) is None
        heartbeat.abandon()
        rig.link.put("broken", b"")
        eventually(lambda: "a Zenoh callback failed" in caplog.text)
        with pytest.raises(PortError, match="ZeroDivisionError"):
            deadman.step(1.0)
        eventually(lambda: deadman.step() is WatchdogState.LATCHED and deadman.guard.status.acknowledged)
        assert not rig.robot.moving


def test_a_yes_that_names_no_goal_while_one_runs_acknowledges_nothing(rig, deadman, eventually):
    """As a server on rclpy refuses: return code 0, and no goal."""
    with Heartbeat(rig.link) as heartbeat:
        eventually(lambda: deadman.step() is WatchdogState.ARMED)
        assert rig.nav.send(FAR) is None
        rig.clock.sleep(1.0)
        rig.graph.nav2_faults.cancel_code = 0
        heartbeat.abandon()
        deadman.step(1.0)
        eventually(lambda: bool(deadman.step(0.3)) and rig.graph.nav2.asked["cancel_goal"] > 2)
        assert not deadman.guard.status.acknowledged and not deadman.view.reset().ok
        rig.graph.nav2_faults.cancel_code = None
        eventually(lambda: bool(deadman.step(0.3)) and deadman.guard.status.acknowledged and not rig.robot.moving)
        eventually(lambda: bool(deadman.step(0.3)) and deadman.view.reset().ok)


def test_a_workstation_that_says_goodbye_stops_nothing(rig, deadman, eventually):
    with Heartbeat(rig.link):
        eventually(lambda: deadman.step() is WatchdogState.ARMED)
    eventually(lambda: deadman.step() is WatchdogState.WAITING)
    assert deadman.step(100.0) is WatchdogState.WAITING


def test_a_workstation_that_ends_with_an_error_says_no_goodbye(rig, deadman, eventually):
    with pytest.raises(RuntimeError), Heartbeat(rig.link):
        eventually(lambda: deadman.step() is WatchdogState.ARMED)
        raise RuntimeError("something broke")
    assert deadman.step(1.0) is WatchdogState.LATCHED


def test_without_a_watchdog_the_workstation_says_so(rig):
    view = WatchdogView(rig.link)
    view.start()
    assert "start `openbelief onboard`" in view.trouble()


@pytest.mark.parametrize("payload", [b"", b"{}", b"\xff" * 10, b"x" * 5000, b'{"workstation": "../..", "sequence": 1}'])
def test_bytes_that_are_no_heartbeat_arm_nothing(rig, deadman, eventually, payload, caplog):
    caplog.set_level("WARNING")
    eventually(lambda: rig.link.put("openbelief/heartbeat", payload) is None and "was ignored" in caplog.text)
    assert deadman.step() is WatchdogState.WAITING


def test_the_one_workstation_too_many_is_told_that_nobody_watches_it(rig, deadman, eventually):
    """Sixteen others beat, so the state is armed; the seventeenth must not drive for all that."""
    keys, view = WatchdogKeys(BridgeKeys()), WatchdogView(rig.link, workstation="f" * 32)
    view.start()

    def beat() -> None:
        for number in range(WORKSTATIONS_MAX):
            rig.link.put(keys.heartbeat, packed(HeartbeatMessage(workstation=f"{number:032x}", sequence=0)))

    eventually(
        lambda: bool(deadman.step()) and len(deadman.guard.status.watched) == WORKSTATIONS_MAX,
        "all are watched, once the router knows of our subscription",
        again=beat,
    )
    with Heartbeat(rig.link, workstation="f" * 32):
        eventually(lambda: "takes no more" in (view.trouble() or ""), again=deadman.tell)
        assert deadman.guard.status.state is WatchdogState.ARMED and deadman.view.trouble() is None
    assert len(packed(deadman.guard.status)) < STATUS_MAX_BYTES


def test_who_is_watched_is_named_from_the_first_beat_to_the_goodbye(rig, deadman, eventually):
    view = WatchdogView(rig.link, workstation="a" * 32)
    view.start()
    with Heartbeat(rig.link, workstation="a" * 32):
        eventually(lambda: view.trouble() is None, again=deadman.tell)
        assert deadman.guard.status.watched == ("a" * 32,)
    eventually(lambda: "does not hear" in (view.trouble() or ""), again=deadman.tell)


def test_bad_heartbeats_are_counted_and_not_logged_one_by_one(rig, deadman, eventually, caplog):
    keys = WatchdogKeys(BridgeKeys())

    def beat(workstation: str) -> None:
        rig.link.put(keys.heartbeat, packed(HeartbeatMessage(workstation=workstation * 32, sequence=0)))

    def watched(workstation: str) -> bool:
        return bool(deadman.step()) and workstation * 32 in deadman.guard.status.watched

    eventually(lambda: watched("a"), "the router knows of our subscription", again=lambda: beat("a"))
    for _ in range(1000):
        rig.link.put(keys.heartbeat, b"no heartbeat")
    beat("b")
    eventually(lambda: watched("b"))
    lines = [record.getMessage() for record in caplog.records if "heartbeat was ignored" in record.getMessage()]
    assert len(lines) == 10 and "(512 so far)" in lines[-1]
