"""What `openbelief onboard` publishes: the table of its sensors, and how each is opened."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from drivers.bridge_keys import BridgeKeys
from drivers.clock import SystemClock
from drivers.ports import Clock, StaleData
from drivers.ros_publish import CameraPublisher, CameraTopics, ImuPublisher, LidarPublisher, MountPublisher, Outlet
from drivers.topics import CAMERA_IMU, CAMERA_INFO, LIDAR, LIDAR_IMU, color_topic, depth_topic
from drivers.zenoh_link import ZenohLink
from logs.port_tap import CAMERA_IMU_FRAME
from robot_app.config import Config, mount
from robot_app.local_sensors import open_emulated_livox, open_emulated_realsense, open_livox, open_realsense
from robot_app.sensing import Opened, OpenSensor

if TYPE_CHECKING:
    from drivers.livox.driver import LivoxLidar
    from drivers.realsense import RealSenseCamera

SILENT_S = 3.0  # without a cloud, the lidar is said to be silent

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
        images = CameraPublisher(outlet, clock, camera, rate_hz=config.onboard.camera_rate_hz, topics=topics)
        if not camera.info.has_imu:  # a D435 has none
            return Opened([images], lambda: _trouble(camera))
        imu = ImuPublisher(outlet, camera.take_imu, CAMERA_IMU_FRAME, topic=imu_topic)
        return Opened([images, imu], lambda: _trouble(camera))

    return open_camera


def _lidar(config: Config, outlet: Outlet, source: Callable[..., LivoxLidar]) -> OpenSensor:
    topic = replace(LIDAR, name=config.topics.lidar)
    imu_topic = replace(LIDAR_IMU, name=config.topics.lidar_imu)

    def open_lidar(clock: SystemClock, opened: ExitStack) -> Opened:
        lidar = source(config, clock, opened)
        clouds = LidarPublisher(outlet, clock, lidar, rate_hz=config.onboard.lidar_rate_hz, topic=topic)
        imu = ImuPublisher(outlet, lidar.take_imu, config.livox.frame_id, topic=imu_topic)
        opened_ns = clock.now_ns()
        return Opened([clouds, imu], lambda: _words(lidar, silent=clock.now_ns() - opened_ns > SILENT_S * 1e9))

    return open_lidar


def _trouble(camera: RealSenseCamera) -> Sequence[str]:
    """Why its process was restarted, as long as it is not proven well."""
    trouble = camera.health().trouble
    return [f"It was restarted: {trouble}."] if trouble else []


def _words(lidar: LivoxLidar, *, silent: bool) -> Sequence[str]:
    """The lidar's own health codes, and whether it sends at all."""
    state = lidar.health().state
    words = [str(code) for code in state.health] if state else []
    if silent:
        try:
            lidar.latest(SILENT_S)
        except StaleData:
            words.append("No cloud comes: does the lidar run, and send to this host?")
    return words
