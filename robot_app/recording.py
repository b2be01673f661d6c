"""`openbelief record`: every port of a robot into one recording, whatever bodies stand behind the ports."""

from __future__ import annotations

import platform
import threading
import uuid
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

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
from logs.disk import DiskBudget
from logs.port_tap import PortTap
from logs.queued import QueuedRecorder
from logs.recorder import McapRecorder, Rotation
from logs.recording_files import require_unused
from logs.tap import TopicTap
from logs.versions import commit, versions
from robot_app.app import Robot, Wire, open_robot
from robot_app.config import Config, Topics, dump_config
from robot_app.record_gauge import Gauge, Status
from sim_fakes.walk import Walker

TICK_S = 0.02
ON_THE_WIRE = ("ros", "sim")
PORTS = ("camera", "lidar", "pose", "map")


@dataclass(frozen=True)
class RecordJob:
    """seconds: by the robot's clock, None until stopped or the walk's end. stand: a simulated robot does not walk."""

    config: Config
    path: Path
    seconds: float | None = None
    stand: bool = False


@dataclass(frozen=True)
class Recorded:
    """What lies on the disk. failure: why the recording ended early, None where it did not."""

    paths: tuple[Path, ...]
    status: Status
    failure: str | None


def record(
    job: RecordJob,
    stop: threading.Event,
    show: Callable[[Callable[[], Status]], None],
    tell: Callable[[str], None],
) -> Recorded:
    """Record until `stop`, the time's or the walk's end, or the disk's refusal. show: called each tick, asks when due.

    Raises PortError, SceneError, LogError or OSError with a sentence, before anything is recorded.
    """
    require_unused(job.path, rotated=True)
    with ExitStack() as opened:
        robot = opened.enter_context(open_robot(job.config))
        recorder = opened.enter_context(_recorder(job, robot, tell))
        _describe(recorder, job.config)
        queue = opened.enter_context(QueuedRecorder(recorder, robot.clock))
        tap = start_taps(robot, job.config, queue)
        if robot.site.simulation is not None:
            robot.site.simulation.site.topics.start_imu()
        gauge = Gauge(robot, queue, recorder, tap)
        _run(job, robot, queue, recorder, tap, gauge, stop, show)
        queue.drain()
        status = gauge.status()
        recorder.close()
        return Recorded(tuple(recorder.paths), status, recorder.failure)


def _run(
    job: RecordJob,
    robot: Robot,
    queue: QueuedRecorder,
    recorder: McapRecorder,
    tap: PortTap,
    gauge: Gauge,
    stop: threading.Event,
    show: Callable[[Callable[[], Status]], None],
) -> None:
    begin_ns, simulation = robot.clock.now_ns(), robot.site.simulation
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


def _describe(recorder: McapRecorder, config: Config) -> None:
    """What every file of the recording says about it."""
    about = {"id": str(uuid.uuid4()), "commit": commit(), "host": platform.node(), **versions()}
    recorder.metadata("openbelief.recording", about)
    recorder.attach("robot.toml", "application/toml", dump_config(config).encode(), calibration=True)


def start_taps(robot: Robot, config: Config, queue: QueuedRecorder) -> PortTap:
    """Each port by its body: what is a topic is copied from the wire, everything else is asked through the port."""
    bodies = config.ports.model_dump()
    for word in ON_THE_WIRE:
        on_wire = [port for port in PORTS if bodies[port] == word]
        if on_wire:
            _tap_wire(robot.site.wires[word], on_wire, queue)
    tap = PortTap(queue)
    if bodies["camera"] not in ON_THE_WIRE:
        tap.add_camera(robot.camera)
    if bodies["lidar"] not in ON_THE_WIRE:
        tap.add_lidar(robot.lidar)
    if bodies["pose"] not in ON_THE_WIRE:
        tap.add_poses(robot.poses, robot.camera, robot.lidar)
    if bodies["map"] not in ON_THE_WIRE:
        tap.add_map(robot.map)
    return tap


def _tap_wire(wire: Wire, ports: list[str], queue: QueuedRecorder) -> None:
    color = color_topic(wire.topics.color) if "camera" in ports else None
    others = [topic for port in ports for topic in wire_topics(port, wire.topics)]
    TopicTap(wire.link, queue, wire.keys, color=color, others=others).start()


def wire_topics(port: str, names: Topics) -> tuple[Topic, ...]:
    """The topics of a port, beside colour."""
    table = {
        "camera": ((DEPTH, names.depth), (CAMERA_INFO, names.camera_info), (CAMERA_IMU, names.camera_imu)),
        "lidar": ((LIDAR, names.lidar), (LIDAR_IMU, names.lidar_imu)),
        "pose": ((TF, TF.name), (TF_STATIC, TF_STATIC.name)),
        "map": ((MAP, names.map),),
    }
    return tuple(replace(topic, name=name) for topic, name in table[port])
