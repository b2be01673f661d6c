"""The small process on the robot: the watchdog, and the sensors as ROS topics where no ROS node publishes them."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import Any

from drivers.bridge_keys import BridgeKeys
from drivers.clock import SystemClock
from drivers.ports import Clock, LinkLost, PortError
from drivers.ros_publish import CameraTopics, SensorPublisher
from drivers.topics import CAMERA_INFO, LIDAR, color_topic, depth_topic
from drivers.watchdog_guard import WatchdogGuard
from drivers.zenoh_link import LinkConfig, ZenohLink
from logs.structured import logger
from robot_app.config import Config, Topics, mount

WATCH_S = 0.02  # the watchdog looks 50 times a second
SENSE_S = 0.005
RECONNECT_S = 2.0


def run_onboard(config: Config, stop: threading.Event, tell: Callable[[str], None]) -> None:
    """Until `stop`. Raises PortError where a sensor cannot be opened, LinkLost where the session to the bridge closed.

    The watchdog has the calling thread; the sensors have one of their own, whose trouble never reaches the watchdog.
    """
    clock = SystemClock()
    link_config = LinkConfig((config.zenoh.endpoint,), tls=config.zenoh.tls)
    with ExitStack() as opened:
        link = _connected(link_config, stop, tell, opened)
        if link is None:
            return
        guard = WatchdogGuard(link, BridgeKeys(config.zenoh.namespace), distribution=config.zenoh.distribution)
        guard.start()
        tell(f"The watchdog watches through {config.zenoh.endpoint}.")
        if publisher := _publisher(config, link, clock, opened):
            sensing = threading.Thread(target=_sense, args=(publisher, stop), name="sensors", daemon=True)
            sensing.start()
            opened.callback(sensing.join)
        opened.callback(stop.set)
        while not stop.wait(WATCH_S):
            _step(guard)


def _connected(
    config: LinkConfig, stop: threading.Event, tell: Callable[[str], None], opened: ExitStack
) -> ZenohLink | None:
    """The bridge may start after us; None where `stop` came first."""
    told = ""
    while not stop.is_set():
        try:
            return opened.enter_context(ZenohLink(config))
        except LinkLost as error:
            if str(error) != told:
                tell(told := str(error))
        stop.wait(RECONNECT_S)
    return None


def _step(guard: WatchdogGuard) -> None:
    """A message that a handler failed on is logged: the watchdog watches on. A closed session ends the process."""
    try:
        guard.step()
    except LinkLost:
        raise
    except PortError as error:
        logger().error("watchdog_handler", reason=str(error))


def _publisher(config: Config, link: ZenohLink, clock: Clock, opened: ExitStack) -> SensorPublisher | None:
    onboard, topics = config.onboard, config.topics
    camera = SOURCES["camera", onboard.camera](config, clock, opened)
    lidar = SOURCES["lidar", onboard.lidar](config, clock, opened)
    if camera is None and lidar is None and not onboard.mounts:
        return None
    return SensorPublisher(
        link,
        clock,
        BridgeKeys(config.zenoh.namespace),
        camera=camera,
        lidar=lidar,
        camera_rate_hz=onboard.camera_rate_hz,
        lidar_rate_hz=onboard.lidar_rate_hz,
        mounts=[mount(text) for text in onboard.mounts],
        camera_topics=_camera_topics(topics),
        lidar_topic=replace(LIDAR, name=topics.lidar),
    )


def _camera_topics(topics: Topics) -> CameraTopics:
    return CameraTopics(
        color_topic(topics.color), depth_topic(topics.depth), replace(CAMERA_INFO, name=topics.camera_info)
    )


def _sense(publisher: SensorPublisher, stop: threading.Event) -> None:
    failed = ""
    while not stop.wait(SENSE_S):
        try:
            publisher.step()
        except PortError as error:  # its data grows old at the workstation, which says so
            if str(error) != failed:
                failed = str(error)
                logger().error("sensor", reason=failed)


def _nothing(config: Config, clock: Clock, opened: ExitStack) -> None:  # noqa: ARG001
    return None


def _realsense(config: Config, clock: Clock, opened: ExitStack) -> Any:
    from drivers.realsense import RealSenseCamera
    from drivers.realsense_frames import RealSenseSettings

    settings = RealSenseSettings(**config.realsense.model_dump())
    return opened.enter_context(RealSenseCamera(settings, clock))


def _emulated_realsense(config: Config, clock: Clock, opened: ExitStack) -> Any:
    from drivers.realsense import RealSenseCamera
    from drivers.realsense_frames import RealSenseSettings
    from sim_fakes.realsense_software import TwinSpec, TwinState, box_images, open_twin

    settings = RealSenseSettings(**config.realsense.model_dump())
    twin = partial(open_twin, box_images, TwinSpec(), TwinState())
    return opened.enter_context(RealSenseCamera(settings, clock, open_device=twin))


def _livox(config: Config, clock: Clock, opened: ExitStack) -> Any:
    from drivers.livox.driver import LivoxLidar, LivoxSettings

    return opened.enter_context(LivoxLidar(LivoxSettings(**config.livox.model_dump()), clock))


def _emulated_livox(config: Config, clock: Clock, opened: ExitStack) -> Any:
    from drivers.livox.driver import LivoxLidar, LivoxSettings
    from sim_fakes.livox_emulator import EmulatorSettings, LivoxEmulator

    host = LivoxSettings(
        lidar_ip="127.0.0.2",
        host_ip="127.0.0.1",
        points_port=0,
        imu_port=0,
        push_port=0,
        frame_id=config.livox.frame_id,
    )
    lidar = opened.enter_context(LivoxLidar(host, clock))
    lidar_ports = dict.fromkeys(("search_port", "command_port", "push_port", "points_port", "imu_port"), 0)
    host_ports = {f"host_{name}_port": port for name, port in lidar.ports.items()}
    opened.enter_context(LivoxEmulator(EmulatorSettings(**lidar_ports, **host_ports), clock=clock))  # type: ignore[arg-type]
    return lidar


# (sensor, word in [onboard]) -> what is published
SOURCES: dict[tuple[str, str], Callable[[Config, Clock, ExitStack], Any]] = {
    ("camera", "off"): _nothing,
    ("camera", "real"): _realsense,
    ("camera", "sim"): _emulated_realsense,
    ("lidar", "off"): _nothing,
    ("lidar", "real"): _livox,
    ("lidar", "sim"): _emulated_livox,
}
