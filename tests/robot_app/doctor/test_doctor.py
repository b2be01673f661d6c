"""`openbelief doctor`: a healthy robot is healthy, and every fault is found where it lies, with its remedy."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from behaviors.safety_policy import SafetyPolicy
from drivers.clock import SystemClock
from drivers.ros.convert import battery_message
from drivers.ros.diagnosis import Diagnosis, Severity, diagnostics_message
from drivers.ros.messages import encode
from drivers.ros.publish import Outlet
from drivers.ros.topics import RosBattery
from drivers.ros.zenoh_link import ZenohLink
from drivers.topics import BATTERY, CAMERA_INFO, COLOR, DEPTH, DIAGNOSTICS, LIDAR, TF
from drivers.watchdog.guard import WatchdogGuard
from drivers.watchdog.heartbeat import Heartbeat, WatchdogView
from robot_app.app import Robot, open_robot
from robot_app.cli import main
from robot_app.config import Config
from robot_app.config_sections import PortsSection
from robot_app.doctor.examination import examine_robot
from robot_app.doctor.finding import Examined, Finding, Level
from robot_app.doctor.link import check_bridge, stays_here
from robot_app.doctor.robot import check_battery, check_lidar, port_topics
from robot_app.doctor.topic_probe import TopicProbe
from robot_app.doctor.watchdog import check_watchdog
from robot_app.verbs.doctor import written
from sim_fakes.sensors.livox_emulator import EmulatorSettings, LivoxEmulator
from sim_fakes.wire.faults import garbage, shifted

CONFIG = Config()
DAY_NS = 86_400 * 10**9
Eventually = Callable[[Callable[[], bool]], None]


@pytest.fixture(scope="module")
def open_one() -> Iterator[Robot]:
    with open_robot(CONFIG) as robot:
        yield robot


@pytest.fixture
def robot(open_one: Robot) -> Iterator[Robot]:
    """The simulated robot, without faults before and after."""
    assert open_one.wiring.simulation is not None
    graph = open_one.wiring.simulation.graph
    yield open_one
    graph.nav2_faults.inactive, graph.sensor_faults.frozen_ns = False, None
    graph.sensor_faults.muted.clear()
    graph.sensor_faults.spoiled.clear()
    open_one.clock.sleep(3.0)


def findings(robot: Robot) -> dict[str, Finding]:
    return {line.name: line for line in examine_robot(CONFIG, robot)}


def bad(found: dict[str, Finding]) -> set[str]:
    return {name for name, line in found.items() if line.level != Level.OK}


def test_a_healthy_site_is_healthy(robot: Robot) -> None:
    found = findings(robot)
    assert bad(found) == set()
    assert {"link", "camera", "lidar", "clocks", "map", "tf map -> base_link", "nav2 active"} <= set(found)
    assert "odom -> base_link" in found["tf map -> base_link"].said


def test_an_inactive_nav2_is_found(robot: Robot) -> None:
    robot.wiring.simulation.graph.nav2_faults.inactive = True
    found = findings(robot)
    assert bad(found) == {"nav2 active"}
    assert "lifecycle_manager" in found["nav2 active"].remedy


def test_a_silent_lidar_is_found(robot: Robot) -> None:
    robot.wiring.simulation.graph.sensor_faults.muted.add(LIDAR.name)
    found = findings(robot)
    assert bad(found) == {"lidar", "lidar rate"}
    assert found["lidar"].level == Level.FAIL and found["lidar"].remedy
    assert "0.0 Hz" in found["lidar rate"].said


def test_garbage_on_a_topic_is_counted(robot: Robot) -> None:
    robot.wiring.simulation.graph.sensor_faults.spoiled[TF.name] = garbage
    found = findings(robot)
    assert found["tf map -> base_link"].level == Level.FAIL
    assert "nav2 pose" in bad(found)


def test_stamps_that_stand_still_are_found(robot: Robot) -> None:
    robot.wiring.simulation.graph.sensor_faults.frozen_ns = robot.clock.now_ns()
    found = findings(robot)
    assert found["camera rate"].level == Level.FAIL and "stand still" in found["camera rate"].said
    assert found["tf map -> base_link"].level == Level.FAIL


@pytest.mark.parametrize(("ahead_s", "level"), [(0.1, Level.WARN), (5.0, Level.FAIL)])
def test_clocks_that_differ_are_found(robot: Robot, ahead_s: float, level: Level) -> None:
    spoiled = robot.wiring.simulation.graph.sensor_faults.spoiled
    for topic in (COLOR, DEPTH, CAMERA_INFO, LIDAR, TF):
        spoiled[topic.name] = shifted(topic, ahead_s)
    found = findings(robot)
    assert found["clocks"].level == level
    assert f"{-1000 * ahead_s:.0f} ms" in found["clocks"].said and "chrony" in found["clocks"].remedy


@pytest.fixture
def ros_patient(robot: Robot) -> Examined:
    """The same wire, as if the robot at its other end were a real one: with a watchdog to hear, and a battery port."""
    wire = robot.wiring.wires["sim"]
    view, battery = WatchdogView(wire.link, wire.keys), RosBattery(wire.link, robot.clock)
    view.start()
    battery.start()
    config = Config(ports=PortsSection(navigator="ros", battery="ros"))
    return Examined(config, replace(robot, battery=battery), TopicProbe(robot.clock), view)


def without_watchdog(patient: Examined) -> Examined:
    """The robot does without one."""
    safety = SafetyPolicy(watchdog="off")
    return replace(patient, config=patient.config.model_copy(update={"safety": safety}))


def test_a_watchdog_that_is_not_heard_fails_where_missions_need_one(ros_patient: Examined) -> None:
    [line] = check_watchdog(ros_patient)
    assert line.level == Level.FAIL and "openbelief onboard" in line.remedy
    [line] = check_watchdog(without_watchdog(ros_patient))
    assert line.level == Level.OK and "not required" in line.said


def test_the_watchdogs_own_word_is_told_from_waiting_to_latched(ros_patient: Examined, eventually: Eventually) -> None:
    config = ros_patient.robot.wiring.wires["sim"].link.config
    with ZenohLink(config) as onboard, ZenohLink(config) as workstation:
        guard = WatchdogGuard(onboard)
        guard.start()

        def says(level: Level, text: str) -> bool:
            guard.step()
            [line] = check_watchdog(ros_patient)
            return line.level == level and text in line.said

        eventually(lambda: says(Level.OK, "waiting"))
        with Heartbeat(workstation) as heartbeat:
            eventually(lambda: says(Level.OK, "armed"))
            heartbeat.abandon()
            eventually(lambda: says(Level.FAIL, "silent for"))
        [line] = check_watchdog(without_watchdog(ros_patient))
        assert line.level == Level.FAIL and "--reset" in line.remedy


@pytest.mark.parametrize(("charge", "level"), [(0.8, Level.OK), (0.3, Level.WARN), (0.2, Level.FAIL)])
def test_a_charge_is_judged_by_the_limits_of_missions(
    ros_patient: Examined, eventually: Eventually, charge: float, level: Level
) -> None:
    patient = ros_patient
    [line] = check_battery(patient)
    assert line.level == Level.FAIL and "No battery state yet" in line.said and "none" in line.remedy

    def heard() -> bool:
        stamp_ns = patient.robot.clock.now_ns()
        bridge = patient.robot.wiring.simulation.graph.bridge
        bridge.publish(BATTERY, encode(battery_message(stamp_ns, charge)))
        [line] = check_battery(patient)
        return line.level == level and f"{100 * charge:.0f} %" in line.said

    eventually(heard)


def test_a_battery_that_nobody_watches_is_a_warning_on_a_real_robot_only(ros_patient: Examined) -> None:
    unwatched = replace(ros_patient, robot=replace(ros_patient.robot, battery=None))
    [line] = check_battery(unwatched)
    assert line.level == Level.WARN and "battery" in line.remedy
    assert list(check_battery(replace(unwatched, config=CONFIG))) == []


def doctors_lines(config: Path, capsys: pytest.CaptureFixture[str]) -> list[dict[str, str]]:
    """What `doctor --json` says, which must be one JSON object and nothing else; exit status 1."""
    assert main(["doctor", "--config", str(config), "--json"]) == 1
    result = json.loads(capsys.readouterr().out)
    assert result["ok"] is False
    return result["checks"]


def failing(lines: list[dict[str, str]]) -> list[dict[str, str]]:
    return [line for line in lines if line["level"] == "fail"]


OUT_OF_REACH = '[zenoh]\nendpoint = "tcp/127.0.0.1:9"\n'


def test_no_router_is_one_line_with_the_cause_and_a_remedy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ros = "".join(f'{port} = "ros"\n' for port in ("camera", "lidar", "pose", "map", "navigator"))
    (tmp_path / "robot.toml").write_text(f"[ports]\n{ros}{OUT_OF_REACH}")
    [line] = failing(doctors_lines(tmp_path / "robot.toml", capsys))
    assert line["name"] == "robot" and "Nothing answers at tcp/127.0.0.1:9" in line["said"]
    assert "check the network, and the bridge on the robot" in line["remedy"]


@pytest.mark.parametrize(
    ("text", "said", "remedy"),
    [(None, "No such file", "demo-out/robot.toml"), ("[ports]\ncamera = 'webcam'", "ports.camera", "mend that line")],
)
def test_without_a_usable_robot_toml_this_machine_is_looked_at_all_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str | None, said: str, remedy: str
) -> None:
    if text is not None:
        (tmp_path / "robot.toml").write_text(text)
    lines = doctors_lines(tmp_path / "robot.toml", capsys)
    assert lines[0]["name"] == "config" and said in lines[0]["said"] and remedy in lines[0]["remedy"]
    assert {"disk", "memory", "perception", "gpu"} <= {line["name"] for line in lines}
    assert [line["name"] for line in failing(lines)] == ["config"]


@pytest.fixture
def lidar_toml(tmp_path: Path) -> Iterator[tuple[LivoxEmulator, Path]]:
    """A MID-360 with a dirty window and a broken link behind it, and a robot.toml whose robot is out of reach."""
    network = f"127.{os.getpid() % 200 + 10}.{os.getpid() // 200 % 200}"  # all of 127/8 is this machine
    settings = EmulatorSettings(lidar_ip=f"{network}.120", host_ip=f"{network}.164")
    with LivoxEmulator(settings, clock=SystemClock()) as lidar:
        lidar.stream.health = (0x01040002, 0x04010003)
        ros = "".join(f'{port} = "ros"\n' for port in ("pose", "map", "navigator"))
        addresses = f'[livox]\nlidar_ip = "{settings.lidar_ip}"\nhost_ip = "{settings.host_ip}"\n'
        (tmp_path / "robot.toml").write_text(f'[ports]\ncamera = "ros"\nlidar = "real"\n{ros}{OUT_OF_REACH}{addresses}')
        yield lidar, tmp_path / "robot.toml"


def test_with_the_bridge_down_the_lidar_here_is_looked_at_and_its_health_codes_are_told_in_words(
    lidar_toml: tuple[LivoxEmulator, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    lines = doctors_lines(lidar_toml[1], capsys)
    told = {line["name"]: line for line in lines}
    assert told["lidar"]["level"] == "ok" and told["lidar loss"]["said"]
    assert "of 10 Hz" in told["lidar rate"]["said"] and not told["lidar rate"]["said"].startswith("0.0")
    assert (told["lidar state"]["level"], told["lidar state"]["said"]) == (
        "ok",
        "sampling, 45 degrees C inside, 2 health codes",
    )
    codes = [(line["level"], line["said"], line["remedy"]) for line in lines if line["name"] == "lidar health"]
    assert codes == [
        ("warn", "warning: the window is dirty (HMS 0104)", "clean the window with a soft cloth"),
        ("fail", "error: the network link dropped (HMS 0401)", "check the cable, the plug and the switch"),
    ]


def test_what_onboard_says_of_its_lidar_reaches_the_doctor_at_the_workstation(
    ros_patient: Examined, eventually: Eventually
) -> None:
    """And what others say on /diagnostics does not."""
    wire, ears = ros_patient.robot.wiring.wires["sim"], ros_patient.ears
    dirty = Diagnosis("lidar health", Severity.WARN, "warning: the window is dirty (HMS 0104)", "clean it")
    ears.hear_diagnoses(wire)
    with ZenohLink(wire.link.config) as robot:
        outlet = Outlet(robot)
        other = diagnostics_message(0, [Diagnosis("lidar motor", Severity.ERROR, "not ours")])
        other.status[0].hardware_id = "somebody's lidar"

        def heard() -> bool:
            outlet.send(DIAGNOSTICS, other)
            outlet.send(DIAGNOSTICS, diagnostics_message(0, [dirty]))
            return bool(ears.diagnoses)

        eventually(heard)
    ears.hear(wire, port_topics("lidar", ros_patient.config, ros_patient.robot))
    ears.listen(1.0)
    lines = {line.name: line for line in check_lidar(ros_patient)}
    assert lines["lidar health"] == Finding("lidar health", Level.WARN, dirty.said, "clean it")
    assert "lidar motor" not in lines


@pytest.mark.parametrize(
    ("endpoint", "here"), [("tcp/127.0.0.1:7447", True), ("tcp/localhost:1", True), ("tcp/192.168.1.2:7447", False)]
)
def test_only_the_loopback_may_go_unencrypted(endpoint: str, here: bool) -> None:
    assert stays_here(endpoint) is here


def test_what_a_robot_says_cannot_move_the_terminals_cursor() -> None:
    text = written(Finding("lidar", Level.FAIL, "\x1b[2Jgone", "look\nthere"))
    assert "\x1b" not in text and text.startswith("fail  lidar: ")


@pytest.mark.parametrize(
    ("version", "level", "words"),
    [
        ('"1.10.0"', Level.OK, "1.10.0"),
        ('"1.11.2-dev"', Level.OK, "1.11.2"),
        ('"v1.7.2"', Level.WARN, "1.7.2"),
        ('"1.4.0"', Level.FAIL, "never arrive"),
        ('"no version"', Level.WARN, "does not say its version"),
    ],
)
def test_the_bridges_age_is_found_out(robot: Robot, version: str, level: Level, words: str) -> None:
    bridge = robot.wiring.simulation.graph.bridge
    before, bridge.version = bridge.version, version
    try:
        [line] = check_bridge(SimpleNamespace(robot=robot))  # type: ignore[arg-type]  # it looks at the wires alone
    finally:
        bridge.version = before
    assert line.level == level and words in line.said
    assert bool(line.remedy) == (level != Level.OK)
