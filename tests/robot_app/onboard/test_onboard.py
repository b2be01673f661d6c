"""`openbelief onboard`: the watchdog watches whatever the sensors do, and a sensor's trouble is its own."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import numpy as np
import pytest
import structlog

from drivers.clock import SystemClock
from drivers.livox.settings import LivoxSettings
from drivers.ports import LidarCloud, LinkLost, PortError
from drivers.ros.clouds import cloud_of
from drivers.ros.diagnosis import diagnoses_of
from drivers.ros.messages import decode
from drivers.ros.zenoh_link import LinkConfig, ZenohLink, open_router
from drivers.topics import CAMERA_IMU, DIAGNOSTICS, LIDAR, LIDAR_IMU, TF_STATIC
from drivers.watchdog.heartbeat import Heartbeat, WatchdogView
from drivers.watchdog.latch import WatchdogState
from robot_app.cli import main
from robot_app.config import Config
from robot_app.config_sections import OnboardSection, ZenohSection
from robot_app.onboard import sensors as onboard_sensors
from robot_app.onboard.process import run_onboard

MOUNTS = ("base_link livox_frame 0 0 1.26 3.1416 0.05 0",)


class Site:
    """A router, `run_onboard` beside it, and what a workstation hears of it: payloads by ROS name."""

    def __init__(self, opened: ExitStack) -> None:
        self._opened = opened
        self.endpoint = opened.enter_context(open_router())
        self.link = opened.enter_context(ZenohLink(LinkConfig((self.endpoint,))))
        self.heard: dict[str, list[bytes]] = {}
        self.failure: Exception | None = None
        for topic in (LIDAR, LIDAR_IMU, CAMERA_IMU, TF_STATIC, DIAGNOSTICS):
            payloads = self.heard.setdefault(topic.name, [])
            self.link.subscribe(topic.name.strip("/"), payloads.append)
        self.view = WatchdogView(self.link)
        self.view.start()

    def start(self, onboard: OnboardSection, livox: LivoxSettings | None = None) -> None:
        config = Config(zenoh=ZenohSection(endpoint=self.endpoint), onboard=onboard, livox=livox or LivoxSettings())
        stop = threading.Event()
        running = threading.Thread(target=self._run, args=(config, stop))
        running.start()
        self._opened.callback(running.join)
        self._opened.callback(stop.set)

    def _run(self, config: Config, stop: threading.Event) -> None:
        try:
            run_onboard(config, stop, lambda _: None)
        except Exception as error:  # noqa: BLE001 - asserted by the test
            self.failure = error

    @property
    def state(self) -> WatchdogState | None:
        return self.view.status.state if self.view.status else None


@pytest.fixture
def site() -> Iterator[Site]:
    with ExitStack() as opened:
        yield Site(opened)


@pytest.fixture
def said() -> Iterator[list[dict]]:
    with structlog.testing.capture_logs() as lines:
        yield lines


def says(said: list[dict], sensor: str, text: str) -> bool:
    return any(line.get("sensor") == sensor and text in str(line.get("reason", "")) for line in said)


class Lidar:
    """Something new at every look."""

    def __init__(self, clock: SystemClock) -> None:
        self._clock = clock

    def latest(self, max_age_s: float) -> LidarCloud:
        return LidarCloud(self._clock.now_ns(), np.ones((3, 3), np.float32), "livox_frame")

    def take_imu(self) -> list[Any]:
        return []

    def health(self) -> Any:
        return type("Health", (), {"state": None})


@pytest.fixture
def place(monkeypatch):
    """`place(sensor, source)`: what stands behind the word "real"."""
    return lambda sensor, source: monkeypatch.setitem(onboard_sensors.SOURCES, (sensor, "real"), source)


def gone(config, clock, opened):
    raise PortError("No RealSense is connected")


def test_an_unplugged_camera_and_a_foreign_host_address_end_nothing(site, said, eventually, place):
    """203.0.113.9 is nobody's: as on a laptop that is not in the robot's network."""
    place("camera", gone)
    site.start(OnboardSection(camera="real", lidar="real", mounts=MOUNTS), LivoxSettings(host_ip="203.0.113.9"))
    eventually(lambda: site.state is WatchdogState.WAITING)
    eventually(lambda: says(said, "camera", "No RealSense") and says(said, "lidar", "Cannot listen for lidar"))
    eventually(lambda: len(site.heard[TF_STATIC.name]) >= 2)
    assert site.failure is None


def test_a_lidar_that_cannot_be_taken_over_ends_nothing(site, said, eventually):
    livox = LivoxSettings(lidar_ip="127.77.7.7", host_ip="127.77.7.8", take_control=True)
    site.start(OnboardSection(lidar="real"), livox)
    eventually(lambda: says(said, "lidar", "The lidar at 127.77.7.7:56100 did not answer SET"))
    assert site.state is WatchdogState.WAITING and site.failure is None


def test_the_watchdog_watches_while_a_sensor_takes_its_time_to_open(site, eventually, place):
    opening, open_now = threading.Event(), threading.Event()

    def slow(config, clock, opened):
        opening.set()
        open_now.wait()
        raise PortError("nothing there after 25 s")

    place("camera", slow)
    site.start(OnboardSection(camera="real"))
    try:
        assert opening.wait(20)
        with Heartbeat(site.link) as heartbeat:
            eventually(lambda: site.state is WatchdogState.ARMED)
            heartbeat.abandon()
            eventually(lambda: site.state is WatchdogState.LATCHED)
    finally:
        open_now.set()


def test_a_camera_that_failed_for_good_stops_neither_lidar_nor_mounts(site, said, eventually, place):
    @contextmanager
    def camera():
        class Failed:
            info = type("Info", (), {"has_imu": False})

            def latest(self, max_age_s):
                raise LinkLost("5 hardware resets did not help")

        yield Failed()

    place("camera", lambda config, clock, opened: opened.enter_context(camera()))
    place("lidar", lambda config, clock, opened: Lidar(clock))
    site.start(OnboardSection(camera="real", lidar="real", mounts=MOUNTS))
    eventually(lambda: says(said, "camera", "5 hardware resets"))
    seen = len(site.heard[LIDAR.name])
    eventually(lambda: len(site.heard[LIDAR.name]) > seen + 5 and len(site.heard[TF_STATIC.name]) >= 2)


def test_a_fault_of_a_sensors_own_is_logged_and_the_others_go_on(site, said, eventually, place):
    def broken(config, clock, opened):
        raise ZeroDivisionError("a fault of ours")

    place("camera", broken)
    place("lidar", lambda config, clock, opened: Lidar(clock))
    site.start(OnboardSection(camera="real", lidar="real"))
    eventually(lambda: says(said, "camera", "ZeroDivisionError: a fault of ours"))
    seen = len(site.heard[LIDAR.name])
    eventually(lambda: len(site.heard[LIDAR.name]) > seen + 5)
    assert site.state is WatchdogState.WAITING


def said_of(name: str, site: Site) -> str:
    heard = [diagnoses_of(decode(payload, DIAGNOSTICS.type_name)) for payload in site.heard[DIAGNOSTICS.name]]
    return next((found.said for diagnoses in heard for found in diagnoses if found.name == name), "")


def test_the_emulated_sensors_are_published_with_both_imus_their_words_and_all_that_the_lidar_knows(site, eventually):
    site.start(OnboardSection(camera="sim", lidar="sim"))
    eventually(lambda: all(site.heard[topic.name] for topic in (LIDAR, LIDAR_IMU, CAMERA_IMU)))
    message = decode(site.heard[LIDAR.name][-1], LIDAR.type_name)
    assert len(cloud_of(message).points) > 5000 and message.fields[-1].name == "timestamp"
    eventually(lambda: said_of("lidar state", site) and said_of("camera state", site))
    assert "sampling" in said_of("lidar state", site)
    imus = (LIDAR_IMU, CAMERA_IMU)
    frames = {topic: decode(site.heard[topic.name][0], topic.type_name).header.frame_id for topic in imus}
    assert frames == {LIDAR_IMU: "livox_frame", CAMERA_IMU: "camera_imu_optical_frame"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[onboard]\nlidar = 'real'\n[livox]\nlidar_ip = 'hello'", "livox.lidar_ip"),
        ("[zenoh]\nendpoint = 'bogus'", "zenoh.endpoint"),
        ("[onboard]\ncamera = 'real'\n[realsense]\ncolor_size = [10, 10]", "realsense.color_size"),
    ],
)
def test_what_robot_toml_says_wrongly_is_one_line_and_exit_status_1(tmp_path, capsys, text, words):
    (tmp_path / "robot.toml").write_text(text)
    assert main(["onboard", "--config", str(tmp_path / "robot.toml")]) == 1
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith("openbelief onboard: ") and words in line
