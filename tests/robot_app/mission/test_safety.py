"""Live missions are watched: the heartbeat lives as long as they do, and over ROS the watchdog must be heard."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import robot_app.mission.safety
from behaviors.safety_policy import SafetyPolicy
from drivers.clock import SimClock
from drivers.ports import BatteryState, Reaction, StaleData
from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.zenoh_link import LinkConfig, ZenohLink, open_router
from drivers.watchdog.guard import WatchdogGuard
from drivers.watchdog.latch import WatchdogState
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid
from robot_app.config import Config, ConfigError, dump_config, load_config
from robot_app.config_sections import PortsSection, TopicsSection
from robot_app.mission.safety import FIRST_DATA_S, watched
from robot_app.wiring import Wire


@pytest.fixture
def robot(monkeypatch):
    """A robot with nothing but a link and a pose; `config(**safety)` and the guard on the other side."""
    monkeypatch.setattr(robot_app.mission.safety, "ARMED_S", 0.1)
    with (
        open_router() as endpoint,
        ZenohLink(LinkConfig((endpoint,))) as ours,
        ZenohLink(LinkConfig((endpoint,))) as far,
    ):
        yield SimpleNamespace(
            clock=SimClock(0),
            poses=SimpleNamespace(robot_pose=lambda age: Pose2(0.0, 0.0, 0.0)),
            map=SimpleNamespace(latest=lambda: OccupancyGrid(np.zeros((9, 9), np.int8), 1.0, (0.0, 0.0))),
            camera=None,
            lidar=None,
            battery=None,
            navigator=SimpleNamespace(unavailable=lambda: None),
            wiring=SimpleNamespace(wires={word: Wire(ours, BridgeKeys(), TopicsSection()) for word in ("ros", "sim")}),
            guard=WatchdogGuard(far),
        )


def config(folder, navigator="ros", **safety) -> Config:
    return Config(
        trials=folder, ports=PortsSection(navigator=navigator), safety=SafetyPolicy(disk_min_bytes=0, **safety)
    )


def empty_memory():
    return SimpleNamespace(objects=())


def test_over_ros_no_mission_begins_without_a_watchdog_that_hears_us(robot, tmp_path, eventually):
    with watched(config(tmp_path), robot, empty_memory()) as watch:
        assert watch.safety.verdict(None).condition == "watchdog"
        robot.guard.start()

        def armed() -> bool:
            robot.guard.step()
            return watch.safety.verdict(None).reaction is Reaction.GO

        eventually(armed)
        assert robot.guard.status.state is WatchdogState.ARMED
    eventually(lambda: robot.guard.step() is None and robot.guard.status.state is WatchdogState.WAITING)


@pytest.mark.parametrize(("navigator", "watchdog"), [("sim", "required"), ("ros", "off")])
def test_a_simulated_robot_or_a_site_that_says_so_needs_none(robot, tmp_path, navigator, watchdog):
    with watched(config(tmp_path, navigator, watchdog=watchdog), robot, empty_memory()) as watch:
        assert watch.safety.verdict(None).reaction is Reaction.GO


def test_a_first_message_that_is_still_on_its_way_is_waited_for(robot, tmp_path):
    def charge(max_age_s):
        if robot.clock.now_ns() < 1_000_000_000:
            raise StaleData("No battery state yet.")
        return BatteryState(robot.clock.now_ns(), 0.9)

    robot.battery = SimpleNamespace(latest=charge)
    with watched(config(tmp_path, watchdog="off"), robot, empty_memory()) as watch:
        assert watch.safety.verdict(None).reaction is Reaction.GO


def test_what_does_not_come_is_waited_for_within_bounds_and_named(robot, tmp_path):
    def no_charge(max_age_s):
        raise StaleData("No battery state yet.")

    robot.battery = SimpleNamespace(latest=no_charge)
    with watched(config(tmp_path, watchdog="off"), robot, empty_memory()) as watch:
        assert watch.safety.verdict(None).condition == "battery unknown"
    assert robot.clock.now_ns() <= FIRST_DATA_S * 1e9


def test_a_lost_link_is_a_verdict(robot, tmp_path):
    with watched(config(tmp_path, watchdog="off"), robot, empty_memory()) as watch:
        robot.wiring.wires["ros"].link.close()
        assert watch.safety.verdict(None).condition == "link"


def test_zones_and_mounts_in_robot_toml_read_back_to_the_same_values(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(
        "[safety]\nkeep_out = [[[2.0, 2.0], [4.0, 2.0], [4.0, 4.0]]]\nallowed = [[0, 0], [9, 0], [9, 7]]\n"
        "[onboard]\nmounts = ['base_link livox_frame 0 0 1.264 3.14159 0.05 0']\n"
    )
    first = load_config(path)
    assert first.safety.keep_out == (((2.0, 2.0), (4.0, 2.0), (4.0, 4.0)),)
    path.write_text(dump_config(first))
    assert load_config(path) == first


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("[safety]\nkeep_out = [[[0.0, 0.0], [1.0, 1.0]]]", "needs 3 or more"),
        ("[safety]\nbattery_start = -1.0", "greater than 0"),
        ("[safety]\nwatchdog = 'maybe'", "safety.watchdog"),
        ("[onboard]\nmounts = ['base_link livox_frame 0 0']", "parent child x y z roll pitch yaw"),
    ],
)
def test_limits_that_cannot_be_meant_are_refused_in_one_line(tmp_path, text, complaint):
    path = tmp_path / "robot.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=complaint) as refusal:
        load_config(path)
    assert "\n" not in str(refusal.value)
