"""The doctor's checks of an open robot, after a few seconds of listening to it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from drivers.livox.driver import LivoxLidar
from drivers.nav2.bridge import Nav2Bridge
from drivers.ports import PortError
from drivers.realsense.camera import RealSenseCamera
from drivers.topics import Topic, color_topic
from robot_app.app import Robot
from robot_app.config import Config
from robot_app.doctor.finding import Examined, Finding, Level
from robot_app.doctor.link import MEND, check_bridge, check_link
from robot_app.doctor.sensors import LOSS_WARN, SENSOR_AGE_S, check_real_camera, check_real_lidar, fresh, lines_of
from robot_app.doctor.topic_probe import ProbedTopic
from robot_app.doctor.watchdog import check_watchdog, check_watchdogs_hand
from robot_app.record.recording import ON_THE_WIRE, wire_topics

SKEW_WARN_S, SKEW_FAIL_S = 0.05, 0.25  # later stamps than 0.25 s ahead are refused by the drivers
POSE_AGE_S = 0.5
BATTERY_AGE_S = 10.0
# port -> (the driver of a sensor at this machine, what is looked at there)
DRIVERS: dict[str, tuple[type, Callable[..., Iterator[Finding]]]] = {
    "camera": (RealSenseCamera, check_real_camera),
    "lidar": (LivoxLidar, check_real_lidar),
}


def port_topics(port: str, config: Config, robot: Robot) -> tuple[Topic, ...]:
    """The topics behind a port, the one that paces it first."""
    names = robot.wiring.wires[getattr(config.ports, port)].topics
    return (*([color_topic(names.color)] if port == "camera" else []), *wire_topics(port, names))


def check_camera(patient: Examined) -> Iterator[Finding]:
    return _sensor("camera", patient)


def check_lidar(patient: Examined) -> Iterator[Finding]:
    return _sensor("lidar", patient)


def _sensor(port: str, patient: Examined) -> Iterator[Finding]:
    """What a mission would take of it, what its driver knows, here or on the robot, and how it comes over the wire."""
    sensor, (driver, check) = getattr(patient.robot, port), DRIVERS[port]
    yield from fresh(port, getattr(patient.config.ports, port), sensor.latest)
    if isinstance(sensor, driver):
        yield from check(sensor, patient.ears)
    yield from lines_of(patient.ears.diagnoses.get(port, ()))
    yield from _heard(port, patient)


def check_clocks(patient: Examined) -> Iterator[Finding]:
    """The least age at arrival, over all messages: the way takes milliseconds, the rest are the clocks."""
    moving = {name: heard for name, heard in patient.ears.topics.items() if heard.lags_ns and not heard.frozen}
    if not moving:
        return
    offset_s = min((min(heard.lags_ns) for heard in moving.values()), key=abs) / 1e9
    size = abs(offset_s)
    level = Level.FAIL if size > SKEW_FAIL_S else Level.WARN if size > SKEW_WARN_S else Level.OK
    remedy = "" if level == Level.OK else "synchronise the clocks of both machines (chrony, ptp)"
    yield Finding("clocks", level, f"the robot's stamps arrive {1000 * offset_s:.0f} ms old", remedy)


def check_transforms(patient: Examined) -> Iterator[Finding]:
    """The chain to the base and to each sensor, and the age of every moving part of it."""
    robot, now_ns = patient.robot, patient.robot.clock.now_ns()
    try:
        robot.poses.robot_pose(POSE_AGE_S)
    except PortError as error:
        yield Finding("tf map -> base_link", Level.FAIL, str(error), MEND["pose"])
    else:
        ages = [f"{p} -> {c} {(now_ns - at) / 1e9:.2f} s" for (p, c), at in sorted(_moving(patient).items())]
        yield Finding("tf map -> base_link", Level.OK, ", ".join(ages) or "known")
    for sensor in (robot.camera, robot.lidar):
        try:
            newest = sensor.latest(max(SENSOR_AGE_S.values()))
        except PortError:
            continue  # its own check tells of it
        name = f"tf map -> {newest.frame_id}"
        try:
            robot.poses.transform_at(newest.stamp_ns, newest.frame_id)
        except PortError as error:
            remedy = "publish the mount on /tf_static (robot_state_publisher, or openbelief onboard's mounts)"
            yield Finding(name, Level.FAIL, str(error), remedy)
        else:
            yield Finding(name, Level.OK, "known at the newest stamp")


def check_map(patient: Examined) -> Iterator[Finding]:
    try:
        grid = patient.robot.map.latest()
    except PortError as error:
        yield Finding("map", Level.FAIL, str(error), MEND["map"])
        return
    height, width = grid.cells.shape
    yield Finding("map", Level.OK, f"{width} x {height} cells of {grid.resolution_m:g} m")


def check_nav2(patient: Examined) -> Iterator[Finding]:
    """The signs that Nav2 is up, in the order in which they depend on each other."""
    navigator = patient.robot.navigator
    if not isinstance(navigator, Nav2Bridge):
        return
    for sign in navigator.readiness.read():
        level = Level.OK if sign.ok else Level.FAIL
        yield Finding(
            f"nav2 {sign.name}", level, "there" if sign.ok else sign.sentence, "" if sign.ok else MEND[sign.name]
        )


def check_battery(patient: Examined) -> Iterator[Finding]:
    """Against the limits that missions are held to."""
    robot, limits = patient.robot, patient.config.safety
    if robot.battery is None:
        if patient.config.ports.navigator == "ros":
            remedy = '[ports] battery = "ros" where the robot publishes one, else watch it yourself'
            yield Finding("battery", Level.WARN, "not watched", remedy)
        return
    try:
        charge = robot.battery.latest(BATTERY_AGE_S).fraction
    except PortError as error:
        remedy = 'is sensor_msgs/BatteryState published, and its topic named in [topics]? Else battery = "none"'
        yield Finding("battery", Level.FAIL, str(error), remedy)
        return
    low, empty = charge < limits.battery_start, charge < limits.battery_return
    level = Level.FAIL if empty else Level.WARN if low else Level.OK
    needed = f"missions begin at {100 * limits.battery_start:.0f} % and end below {100 * limits.battery_return:.0f} %"
    yield Finding("battery", level, f"{100 * charge:.0f} %; {needed}", "charge the robot" if low or empty else "")


def _heard(port: str, patient: Examined) -> Iterator[Finding]:
    """Rate, gaps and stamps of the topic that paces a port. A simulated sensor's rate is as configured."""
    word = getattr(patient.config.ports, port)
    if word not in ON_THE_WIRE:
        return
    topic = port_topics(port, patient.config, patient.robot)[0]
    heard, rate_hz = patient.ears.topics[topic.name], patient.ears.rate_hz(topic.name)
    name, said = f"{port} rate", f"{topic.name}: {rate_hz:.1f} Hz, {heard.missing} missing"
    if heard.frozen:
        remedy = "restart the sensor's driver: it sends the same data again and again"
        yield Finding(name, Level.FAIL, f"{said}; the stamps stand still", remedy)
    elif not heard.stamps_ns:
        yield Finding(
            name, Level.FAIL, f"{said}{_unreadable(heard)}", f"look at ros2 topic hz {topic.name} on the robot"
        )
    else:
        slow = word == "ros" and topic.rate_hz is not None and rate_hz < 0.5 * topic.rate_hz
        lossy = heard.missing > max(LOSS_WARN * len(heard.stamps_ns), 1)
        remedy = "cap the rates in the bridge's configuration, or come nearer to the access point"
        bad = slow or lossy or heard.unreadable > 0
        yield Finding(name, Level.WARN if bad else Level.OK, f"{said}{_unreadable(heard)}", remedy if bad else "")


def _unreadable(heard: ProbedTopic) -> str:
    return f", {heard.unreadable} unreadable" if heard.unreadable else ""


def _moving(patient: Examined) -> dict[tuple[str, str], int]:
    return {edge: at for edge, at in patient.ears.edges.items() if at is not None}


ROBOT_CHECKS: tuple[Callable[[Examined], Iterator[Finding]], ...] = (
    check_link,
    check_bridge,
    check_camera,
    check_lidar,
    check_clocks,
    check_transforms,
    check_map,
    check_nav2,
    check_watchdog,
    check_watchdogs_hand,
    check_battery,
)
