"""The watchdog's helper under a robot's ROS Python, against real rclpy on both sides: what Nav2 is told, and when."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from ros_peer.conftest import Process, ros_environment

from drivers.ros import action
from drivers.ros.zenoh_link import LinkConfig, ZenohLink
from drivers.watchdog.heartbeat import WatchdogView
from drivers.watchdog.latch import BRIDGE_GONE, WatchdogState
from drivers.watchdog.ros_hand import RosHelperHand, helper_command
from robot_app.benches.programs import Program


class Robot:
    """ROS's set-up file, and as many Nav2 servers as are asked for, each driving."""

    def __init__(self, opened: ExitStack, folder: Path, python: Path) -> None:
        self._opened, self._folder, self._environment = opened, folder, ros_environment(folder)
        self.setup = folder / "setup.bash"
        ours = {
            name: self._environment[name] for name in self._environment if name.startswith(("ROS_", "RMW_", "FAST"))
        }
        exported = "".join(f"export {name}='{value}'\n" for name, value in ours.items())
        self.setup.write_text(f"{exported}export PATH='{python.parent}':$PATH\n")

    def nav2(self, *words: str) -> Process:
        made = Process("nav2_node.py", words, self._environment, self._folder / "nav2.log")
        self._opened.callback(made.kill)
        made.wait_ready()
        return made


@pytest.fixture
def opened() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def robot(opened: ExitStack, tmp_path: Path, ros_python: Path) -> Robot:
    return Robot(opened, tmp_path, ros_python)


def when(process: Process, event: str) -> list[int]:
    """The moments of what it reported, in nanoseconds of the monotonic clock."""
    return [report[event] for report in process.reports if event in report]


def answers_of(hand: RosHelperHand, trip: int, eventually: Callable[..., None]) -> list[int]:
    codes: list[int] = []
    eventually(lambda: codes.extend(a.code for a in hand.hear() if a.trip == trip) or codes)
    return codes


def test_the_helper_cancels_every_goal_and_hears_that_it_is_done(robot: Robot, eventually) -> None:
    nav2 = robot.nav2()
    with RosHelperHand(helper_command(str(robot.setup))) as hand:
        eventually(lambda: hand.servers == 1 and hand.driving, "the helper sees that Nav2 drives")
        asked_ns = time.monotonic_ns()
        hand.cancel_all(7)
        assert answers_of(hand, 7, eventually) == [action.CANCEL_OK]
        acknowledged_ns = time.monotonic_ns()
        eventually(lambda: when(nav2, "stopped_ns") and not hand.driving, "the goal ends")
        [cancel_ns], [stopped_ns] = when(nav2, "cancel_ns"), when(nav2, "stopped_ns")
        assert asked_ns < cancel_ns < acknowledged_ns and cancel_ns < stopped_ns
        times_ms = [f"{(at_ns - asked_ns) / 1e6:.0f} ms" for at_ns in (cancel_ns, acknowledged_ns, stopped_ns)]
        print("at Nav2, acknowledged and stopped after", *times_ms)
        hand.cancel_all(8)
        assert answers_of(hand, 8, eventually) == [action.CANCEL_OK], "nothing runs: taken as well"
        nav2.kill()
        eventually(lambda: hand.servers == 0, "a Nav2 that ended is reached no more")


def test_a_nav2_that_refuses_is_not_taken_for_one_that_stopped(robot: Robot, eventually) -> None:
    nav2 = robot.nav2("refuses")
    with RosHelperHand(helper_command(str(robot.setup))) as hand:
        eventually(lambda: hand.servers == 1 and hand.driving)
        hand.cancel_all(1)
        assert answers_of(hand, 1, eventually) == [action.CANCEL_REJECTED]
        assert when(nav2, "cancel_ns") and hand.driving and not when(nav2, "stopped_ns")


def test_two_servers_are_counted_and_one_that_goes_on_is_not_outvoted(robot: Robot, eventually) -> None:
    one, other = robot.nav2(), robot.nav2("refuses")
    with RosHelperHand(helper_command(str(robot.setup))) as hand:
        eventually(lambda: hand.servers == 2 and hand.driving)
        hand.cancel_all(1)
        assert action.CANCEL_OK not in answers_of(hand, 1, eventually)
        eventually(lambda: when(one, "stopped_ns") and when(other, "cancel_ns"), "both were asked")
        assert hand.driving


def test_onboard_stops_nav2_through_ros_when_the_bridge_is_killed_in_mid_drive(
    robot: Robot, opened: ExitStack, tmp_path: Path, eventually
) -> None:
    nav2 = robot.nav2()
    bridge = Program(opened, "sim_fakes.wire.nav2_process")
    endpoint = bridge.expect("endpoint")["endpoint"]
    config = tmp_path / "robot.toml"
    config.write_text(f'[zenoh]\nendpoint = "{endpoint}"\n[onboard]\ndds = "ros"\nros_setup = "{robot.setup}"\n')
    onboard = Program(opened, "robot_app.cli", "onboard", "--config", str(config))
    link = opened.enter_context(ZenohLink(LinkConfig((endpoint,))))
    view = WatchdogView(link)
    view.start()
    eventually(lambda: view.status is not None and (view.status.hand, view.status.hand_servers) == ("rclpy", 1))
    workstation = Program(opened, "sim_fakes.wire.workstation_process", endpoint)
    workstation.expect("driving")
    eventually(lambda: view.status is not None and view.status.state is WatchdogState.ARMED)
    killed_ns = time.monotonic_ns()
    bridge.signal(signal.SIGKILL)
    eventually(lambda: when(nav2, "stopped_ns"), "Nav2 stops though there is no bridge")
    cancel_ns, stopped_ns = when(nav2, "cancel_ns")[0], when(nav2, "stopped_ns")[0]
    assert killed_ns < cancel_ns < stopped_ns
    print(f"the cancel is at Nav2 {(cancel_ns - killed_ns) / 1e9:.3f} s after the bridge was killed")
    again = Program(opened, "sim_fakes.wire.nav2_process", "--listen", endpoint)
    again.expect("endpoint")
    eventually(lambda: view.status is not None and view.status.state is WatchdogState.LATCHED)
    assert view.status is not None and view.status.reason == BRIDGE_GONE and view.status.acknowledged
    assert view.reset().ok and not onboard.ended
