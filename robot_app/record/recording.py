"""`openbelief record`: every port of a robot into one recording, whatever bodies stand behind the ports."""

from __future__ import annotations

import mimetypes
import platform
import threading
import uuid
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from drivers.ports import Camera, Lidar
from drivers.realsense.camera import RealSenseCamera
from drivers.topics import (
    CAMERA_IMU,
    CAMERA_INFO,
    DEPTH,
    LIDAR,
    LIDAR_IMU,
    MAP,
    TF,
    TF_STATIC,
    Topic,
    color_topic,
)
from logs.record.calibration import CalibrationSheet
from logs.record.disk import DiskBudget
from logs.record.port_tap import PortTap
from logs.record.queued import QueuedRecorder
from logs.record.recorder import McapRecorder, Rotation
from logs.record.recording_files import require_unused
from logs.record.tap import TopicTap
from logs.versions import commit, versions
from robot_app.app import Robot, open_robot
from robot_app.config import Config, dump_config
from robot_app.config_sections import TopicsSection
from robot_app.record.monitor import RecordingMonitor, RecordingStatus, Taps
from robot_app.wiring import Wire
from sim_fakes.world.walk import Walker

TICK_S = 0.02
ON_THE_WIRE = ("ros", "sim")
PORTS = ("camera", "lidar", "pose", "map")
UNKNOWN = "unknown"


@dataclass(frozen=True)
class RecordJob:
    """seconds: by the robot's clock, None until stopped or the walk's end. stand: a simulated robot does not walk.

    sheet: the team's own file on this walk (goal, people, battery, interventions), kept as an attachment.
    """

    config: Config
    path: Path
    seconds: float | None = None
    stand: bool = False
    sheet: Path | None = None


@dataclass(frozen=True)
class RecordingResult:
    """What lies on the disk. failure: why the recording ended early, None where it did not."""

    paths: tuple[Path, ...]
    status: RecordingStatus
    failure: str | None


def record(
    job: RecordJob,
    stop: threading.Event,
    show: Callable[[Callable[[], RecordingStatus]], None],
    tell: Callable[[str], None],
) -> RecordingResult:
    """Record until `stop`, the time's or the walk's end, or the disk's refusal. show: called each tick, asks when due.

    Raises PortError, SceneError, LogError or OSError with a sentence, before anything is recorded.
    """
    require_unused(job.path, rotated=True)
    sheet = None if job.sheet is None else job.sheet.read_bytes()
    with ExitStack() as opened:
        robot = opened.enter_context(open_robot(job.config))
        recorder = opened.enter_context(_recorder(job, robot, tell))
        _describe(recorder, job, robot, sheet)
        calibration = CalibrationSheet(recorder)
        queue = opened.enter_context(QueuedRecorder(recorder, robot.clock, watch=calibration.see))
        taps = start_taps(robot, job.config, queue)
        if robot.wiring.simulation is not None:
            robot.wiring.simulation.graph.topics.start_imu()
        gauge = RecordingMonitor(robot, queue, recorder, taps)
        _run(job, robot, queue, recorder, taps.ports, gauge, stop, show)
        queue.drain()
        status = gauge.status()
        recorder.close()
        return RecordingResult(tuple(recorder.paths), status, recorder.failure)


def _run(
    job: RecordJob,
    robot: Robot,
    queue: QueuedRecorder,
    recorder: McapRecorder,
    tap: PortTap,
    gauge: RecordingMonitor,
    stop: threading.Event,
    show: Callable[[Callable[[], RecordingStatus]], None],
) -> None:
    begin_ns, simulation = robot.clock.now_ns(), robot.wiring.simulation
    walker = None
    if simulation is not None and not job.stand:
        walker = Walker(simulation.robot, simulation.clock, simulation.world.walk)
    while not stop.is_set() and recorder.failure is None:
        robot.clock.sleep(TICK_S)
        tap.poll()
        gauge.look()
        show(gauge.status)
        if simulation is not None:
            queue.drain()  # simulated time waits for the disk
        if job.seconds is not None and robot.clock.now_ns() - begin_ns >= job.seconds * 1e9:
            return
        if walker is not None and not walker.step():
            return


def _recorder(job: RecordJob, robot: Robot, tell: Callable[[str], None]) -> McapRecorder:
    limits = job.config.recording
    return McapRecorder(
        job.path,
        robot.clock,
        rotation=Rotation(limits.every_s, limits.every_bytes),
        disk=DiskBudget(limits.warn_bytes, limits.stop_bytes),
        tell=tell,
    )


def _describe(recorder: McapRecorder, job: RecordJob, robot: Robot, sheet: bytes | None) -> None:
    """What every file of the recording says about it."""
    recorder.metadata("openbelief.recording", about(job.config, robot))
    recorder.attach("robot.toml", "application/toml", dump_config(job.config).encode(), calibration=True)
    if job.sheet is not None and sheet is not None:
        media_type = mimetypes.guess_type(job.sheet.name)[0] or "text/plain"
        recorder.attach(f"trial_sheet{job.sheet.suffix}", media_type, sheet, calibration=True)


def about(config: Config, robot: Robot) -> dict[str, str]:
    """Who recorded where, with what; what nobody told is `unknown`."""
    told = config.recording
    return {
        "run_id": str(uuid.uuid4()),
        "commit": commit(),
        "operator": told.operator or UNKNOWN,
        "site": told.site or UNKNOWN,
        "robot_serial": told.robot_serial or UNKNOWN,
        "firmware": told.firmware or UNKNOWN,
        **_sensors(config, robot),
        "host": platform.node(),
        **versions(),
    }


def _sensors(config: Config, robot: Robot) -> dict[str, str]:
    """A body's name for each port, and of a camera of this process its own words."""
    bodies = {port: config.ports.model_dump()[port] for port in PORTS}
    if isinstance(robot.camera, RealSenseCamera):
        info = robot.camera.info
        bodies |= {"camera_serial": info.serial, "camera_firmware": info.firmware, "camera_name": info.name}
    return bodies


def start_taps(robot: Robot, config: Config, queue: QueuedRecorder) -> Taps:
    """Each port by its body: what is a topic is copied from the wire, everything else is asked through the port."""
    bodies = config.ports.model_dump()
    on_wire = {word: [port for port in PORTS if bodies[port] == word] for word in ON_THE_WIRE}
    wires = [_tap_wire(robot.wiring.wires[word], ports, queue) for word, ports in on_wire.items() if ports]
    tap = PortTap(queue)
    if bodies["camera"] not in ON_THE_WIRE:
        tap.add_camera(robot.camera, lasting=bodies["camera"] == "real")
    if bodies["lidar"] not in ON_THE_WIRE:
        tap.add_lidar(robot.lidar, lasting=bodies["lidar"] == "real")
    if bodies["pose"] not in ON_THE_WIRE:
        sensors: dict[str, Camera | Lidar] = {"camera": robot.camera, "lidar": robot.lidar}
        tap.add_poses(robot.poses, *(sensor for port, sensor in sensors.items() if bodies[port] in ON_THE_WIRE))
    if bodies["map"] not in ON_THE_WIRE:
        tap.add_map(robot.map)
    return Taps(tap, tuple(wires))


def _tap_wire(wire: Wire, ports: list[str], queue: QueuedRecorder) -> TopicTap:
    color = color_topic(wire.topics.color) if "camera" in ports else None
    others = [topic for port in ports for topic in wire_topics(port, wire.topics)]
    tap = TopicTap(wire.link, queue, wire.keys, color=color, others=others)
    tap.start()
    return tap


def wire_topics(port: str, names: TopicsSection) -> tuple[Topic, ...]:
    """The topics of a port, beside colour."""
    table = {
        "camera": ((DEPTH, names.depth), (CAMERA_INFO, names.camera_info), (CAMERA_IMU, names.camera_imu)),
        "lidar": ((LIDAR, names.lidar), (LIDAR_IMU, names.lidar_imu)),
        "pose": ((TF, TF.name), (TF_STATIC, TF_STATIC.name)),
        "map": ((MAP, names.map),),
    }
    return tuple(replace(topic, name=name) for topic, name in table[port])
