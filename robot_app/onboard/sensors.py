"""What `openbelief onboard` publishes: the table of its sensors, and how each is opened."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from drivers.clock import SystemClock
from drivers.livox.diagnosis import diagnoses
from drivers.ports import Clock, StaleData
from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.diagnosis import Diagnosis, Severity
from drivers.ros.publish import (
    CameraPublisher,
    CameraTopics,
    DiagnosisPublisher,
    ImuPublisher,
    LidarPublisher,
    MountPublisher,
    Outlet,
    Publisher,
)
from drivers.ros.zenoh_link import ZenohLink
from drivers.topics import CAMERA_IMU, CAMERA_INFO, LIDAR, LIDAR_IMU, color_topic, depth_topic
from logs.record.port_tap import CAMERA_IMU_FRAME
from robot_app.config import Config
from robot_app.config_sections import mount
from robot_app.local_sensors import open_emulated_livox, open_emulated_realsense, open_livox, open_realsense
from robot_app.onboard.sensing import Opened, OpenSensor

if TYPE_CHECKING:
    from drivers.livox.driver import LivoxLidar
    from drivers.realsense.camera import RealSenseCamera

FIRST_WORDS_S = 3.0  # until then a lidar need not have said anything, and so long without a cloud it is silent

# (sensor, word in [onboard]) -> how it is opened
SOURCES: dict[tuple[str, str], Callable[[Config, Clock, ExitStack], Any]] = {
    ("camera", "real"): open_realsense,
    ("camera", "sim"): open_emulated_realsense,
    ("lidar", "real"): open_livox,
    ("lidar", "sim"): open_emulated_livox,
}


def sensors(config: Config, link: ZenohLink) -> Iterator[tuple[str, OpenSensor]]:
    """Each sensor that `[onboard]` names, by its name; nothing is opened yet."""
    outlet = Outlet(link, BridgeKeys(config.zenoh.namespace))
    if config.onboard.mounts:
        yield "mounts", _mounts(config, outlet)
    if source := SOURCES.get(("camera", config.onboard.camera)):
        yield "camera", _camera(config, outlet, source)
    if source := SOURCES.get(("lidar", config.onboard.lidar)):
        yield "lidar", _lidar(config, outlet, source)


def _mounts(config: Config, outlet: Outlet) -> OpenSensor:
    mounts = [mount(text) for text in config.onboard.mounts]
    return lambda clock, _opened: Opened([MountPublisher(outlet, clock, mounts)])


def _camera(config: Config, outlet: Outlet, source: Callable[..., RealSenseCamera]) -> OpenSensor:
    names = config.topics
    info = replace(CAMERA_INFO, name=names.camera_info)
    topics = CameraTopics(color_topic(names.color), depth_topic(names.depth), info)
    imu_topic = replace(CAMERA_IMU, name=names.camera_imu)

    def open_camera(clock: SystemClock, opened: ExitStack) -> Opened:
        camera = source(config, clock, opened)
        diagnose = partial(_camera_diagnoses, camera)
        publishers: list[Publisher] = [
            CameraPublisher(outlet, clock, camera, rate_hz=config.onboard.camera_rate_hz, topics=topics),
            DiagnosisPublisher(outlet, clock, diagnose),
        ]
        if camera.info.has_imu:  # a D435 has none
            publishers.append(ImuPublisher(outlet, camera.take_imu, CAMERA_IMU_FRAME, topic=imu_topic))
        return Opened(publishers, diagnose)

    return open_camera


def _lidar(config: Config, outlet: Outlet, source: Callable[..., LivoxLidar]) -> OpenSensor:
    topic = replace(LIDAR, name=config.topics.lidar)
    imu_topic = replace(LIDAR_IMU, name=config.topics.lidar_imu)

    def open_lidar(clock: SystemClock, opened: ExitStack) -> Opened:
        lidar = source(config, clock, opened)
        diagnose = partial(_lidar_diagnoses, lidar, clock, clock.now_ns())
        publishers: list[Publisher] = [
            LidarPublisher(outlet, clock, lidar, rate_hz=config.onboard.lidar_rate_hz, topic=topic),
            ImuPublisher(outlet, lidar.take_imu, config.livox.frame_id, topic=imu_topic),
            DiagnosisPublisher(outlet, clock, diagnose),
        ]
        return Opened(publishers, diagnose)

    return open_lidar


def _camera_diagnoses(camera: RealSenseCamera) -> list[Diagnosis]:
    """Why its process was restarted, as long as it is not proven well."""
    health = camera.health()
    if health.trouble:
        return [Diagnosis("camera state", Severity.WARN, f"it was restarted: {health.trouble}")]
    found = [Diagnosis("camera state", Severity.OK, str(health.phase))]
    if health.info is not None and health.info.imu_trouble:
        said = f"its IMU could not be opened, images come without it: {health.info.imu_trouble}"
        remedy = "give this user librealsense's udev rules, or leave the IMU out with [realsense] imu = false"
        found.append(Diagnosis("camera IMU", Severity.WARN, said, remedy))
    return found


def _lidar_diagnoses(lidar: LivoxLidar, clock: Clock, opened_ns: int) -> list[Diagnosis]:
    """The lidar's own words, and whether clouds come; nothing in its first seconds."""
    if clock.now_ns() - opened_ns < FIRST_WORDS_S * 1e9:
        return []
    health = lidar.health()
    found = diagnoses(health.state)
    if health.clock_changes:
        said = f"its clock was set {health.clock_changes} times, {health.cut} packets were left out"
        remedy = "one time source for the lidar: a PTP master that stays, or none"
        found.append(Diagnosis("lidar clock", Severity.WARN, said, remedy))
    if health.restarts:
        said, remedy = f"it started anew {health.restarts} times", "look at its power supply and its cable"
        found.append(Diagnosis("lidar power", Severity.WARN, said, remedy))
    try:
        lidar.latest(FIRST_WORDS_S)
    except StaleData:
        remedy = "does it run, and does it send to this host?"
        found.append(Diagnosis("lidar state", Severity.ERROR, "no cloud comes", remedy))
    return found
