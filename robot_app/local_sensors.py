"""The sensors that are plugged into this machine, opened by robot.toml for whoever needs one without a whole robot."""

from __future__ import annotations

from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING

from drivers.ports import Clock
from robot_app.config import Config

if TYPE_CHECKING:
    from drivers.livox.driver import LivoxLidar
    from drivers.realsense.camera import RealSenseCamera


def open_realsense(config: Config, clock: Clock, opened: ExitStack) -> RealSenseCamera:
    """Raises PortError where there is none, or none that can serve; it may take 25 s to say so."""
    from drivers.realsense.camera import RealSenseCamera

    return opened.enter_context(RealSenseCamera(config.realsense, clock))


def open_livox(config: Config, clock: Clock, opened: ExitStack) -> LivoxLidar:
    """Raises PortError where its packets cannot be listened for."""
    from drivers.livox.driver import LivoxLidar

    return opened.enter_context(LivoxLidar(config.livox, clock))


def open_emulated_realsense(config: Config, clock: Clock, opened: ExitStack) -> RealSenseCamera:
    from drivers.realsense.camera import RealSenseCamera
    from sim_fakes.sensors.realsense_bus import open_twin
    from sim_fakes.sensors.realsense_faults import TwinState
    from sim_fakes.sensors.realsense_software import TwinSpec, box_images

    twin = partial(open_twin, box_images, TwinSpec(), TwinState())
    return opened.enter_context(RealSenseCamera(config.realsense, clock, open_device=twin))


def open_emulated_livox(config: Config, clock: Clock, opened: ExitStack) -> LivoxLidar:
    from drivers.livox.driver import LivoxLidar
    from drivers.livox.settings import LivoxPorts, LivoxSettings
    from sim_fakes.sensors.livox_emulator import EmulatorSettings, LivoxEmulator

    host = LivoxSettings(lidar_ip="127.0.0.2", host_ip="127.0.0.1", frame_id=config.livox.frame_id)
    lidar = opened.enter_context(LivoxLidar(host, clock, LivoxPorts(points=0, imu=0, push=0)))
    lidar_ports = dict.fromkeys(("search_port", "command_port", "push_port", "points_port", "imu_port"), 0)
    host_ports = {f"host_{name}_port": port for name, port in lidar.ports.items()}
    opened.enter_context(LivoxEmulator(EmulatorSettings(**lidar_ports, **host_ports), clock=clock))  # type: ignore[arg-type]
    return lidar
