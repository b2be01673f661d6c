"""The doctor's checks of an open robot, after a few seconds of listening to it."""

from __future__ import annotations

import ipaddress
from collections.abc import Callable, Iterator

from drivers.livox.driver import LivoxLidar
from drivers.nav2.bridge import Nav2Bridge
from drivers.nav2.bridge_age import LEAST, TESTED, bridge_versions, said
from drivers.ports import PortError
from drivers.realsense.camera import RealSenseCamera
from drivers.topics import Topic, color_topic
from drivers.watchdog.latch import WatchdogState
from robot_app.app import Robot
from robot_app.config import Config
from robot_app.doctor.finding import Examined, Finding, Level
from robot_app.doctor.sensors import LOSS_WARN, SENSOR_AGE_S, check_real_camera, check_real_lidar, fresh, lines_of
from robot_app.doctor.topic_probe import ProbedTopic
from robot_app.record.recording import ON_THE_WIRE, wire_topics

SKEW_WARN_S, SKEW_FAIL_S = 0.05, 0.25  # later stamps than 0.25 s ahead are refused by the drivers
POSE_AGE_S = 0.5
BATTERY_AGE_S = 10.0
MEND = {  # by the sign of Nav2 that is missing
    "link": "check the network, and the bridge on the robot",
    "action server": "start Nav2 with CycloneDDS, and let the bridge forward its actions",
    "active": "bring Nav2 up (ros2 launch nav2_bringup ...); lifecycle_manager_navigation's log says what holds it",
    "pose": "start localisation, and give it a first pose",
    "map": "start map_server, and let the bridge forward /map",
}


def port_topics(port: str, config: Config, robot: Robot) -> tuple[Topic, ...]:
    """The topics behind a port, the one that paces it first."""
    names = robot.wiring.wires[getattr(config.ports, port)].topics
    return (*([color_topic(names.color)] if port == "camera" else []), *wire_topics(port, names))


def check_link(patient: Examined) -> Iterator[Finding]:
    for word, wire in patient.robot.wiring.wires.items():
        where = ", ".join(wire.link.config.endpoints)
        if not wire.link.alive:
            yield Finding(
                "link", Level.FAIL, f"{where} ({word}) is gone", "check the network, and the bridge on the robot"
            )
        elif all(endpoint.startswith("tls/") for endpoint in wire.link.config.endpoints):
            yield Finding("link", Level.OK, f"{where} is reached, encrypted with certificates of both ends")
        elif all(stays_here(endpoint) for endpoint in wire.link.config.endpoints):
            yield Finding("link", Level.OK, f"{where} is reached, unencrypted within this machine")
        else:
            remedy = "make keys with openbelief certs: anybody in this network can drive the robot"
            yield Finding("link", Level.WARN, f"{where} is reached, NOT encrypted", remedy)


def stays_here(endpoint: str) -> bool:
    """Whether an endpoint like tcp/127.0.0.1:7447 is this machine's own."""
    host = endpoint.partition("/")[2].rpartition(":")[0].strip("[]")
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def check_bridge(patient: Examined) -> Iterator[Finding]:
    """Its age: what an old one does wrong shows only as data that never comes."""
    for wire in patient.robot.wiring.wires.values():
        try:
            versions = bridge_versions(wire.link)
        except PortError as error:
            yield Finding("bridge", Level.FAIL, str(error), MEND["link"])
            continue
        if not versions:
            remedy = f"is it zenoh-bridge-ros2dds {said(LEAST)} or newer ({said(TESTED)} is what was tested)?"
            yield Finding("bridge", Level.WARN, "it does not say its version", remedy)
        for version in versions:
            remedy = (
                "" if version >= TESTED else f"install zenoh-bridge-ros2dds {said(TESTED)}, which is what was tested"
            )
            level = Level.OK if version >= TESTED else Level.WARN if version >= LEAST else Level.FAIL
            lost = "" if version >= LEAST else ": /map and /tf_static never arrive behind one so old"
            yield Finding("bridge", level, f"zenoh-bridge-ros2dds {said(version)}{lost}", remedy)


def check_camera(patient: Examined) -> Iterator[Finding]:
    camera = patient.robot.camera
    yield from fresh("camera", patient.config.ports.camera, camera.latest)
    if isinstance(camera, RealSenseCamera):
        yield from check_real_camera(camera, patient.ears)
    yield from lines_of(patient.ears.diagnoses.get("camera", ()))
    yield from _heard("camera", patient)


def check_lidar(patient: Examined) -> Iterator[Finding]:
    lidar = patient.robot.lidar
    yield from fresh("lidar", patient.config.ports.lidar, lidar.latest)
    if isinstance(lidar, LivoxLidar):
        yield from check_real_lidar(lidar, patient.ears)
    yield from lines_of(patient.ears.diagnoses.get("lidar", ()))
    yield from _heard("lidar", patient)


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


def check_watchdog(patient: Examined) -> Iterator[Finding]:
    """Its own word. It is not armed by us: a doctor that is interrupted must not trip it under somebody's mission."""
    if patient.config.ports.navigator != "ros":
        return  # a simulated robot within this process has none
    status = patient.watchdog.status
    if status is None and patient.config.safety.watchdog == "off":
        yield Finding("watchdog", Level.OK, 'not heard, and not required ([safety] watchdog = "off")')
    elif status is None:
        remedy = "start openbelief onboard on the robot: no mission begins without it"
        yield Finding("watchdog", Level.FAIL, "not heard", remedy)
    elif status.state is WatchdogState.LATCHED:
        remedy = "look at the robot, then openbelief onboard --reset"
        yield Finding("watchdog", Level.FAIL, f"latched: {status.reason}", remedy)
    elif status.state is WatchdogState.ARMED:
        names = ", ".join(name[:8] for name in status.watched)
        yield Finding("watchdog", Level.OK, f"armed: it watches {len(status.watched)} workstation(s) ({names})")
    else:
        yield Finding("watchdog", Level.OK, "waiting for a workstation")


def check_watchdogs_hand(patient: Examined) -> Iterator[Finding]:
    """What stops the robot where the bridge is gone."""
    status = patient.watchdog.status
    if patient.config.ports.navigator != "ros" or status is None:
        return
    name = "watchdog without bridge"
    if not status.hand:
        remedy = (
            "on the robot: pip install 'openbelief[dds]', or on ARM [onboard] ros_setup = \"/opt/ros/jazzy/setup.bash\""
        )
        yield Finding(name, Level.FAIL, "nothing: a bridge that dies leaves the robot driving", remedy)
    elif status.hand_servers == 0:
        remedy = "start Nav2 with CycloneDDS in the domain of onboard (ROS_DOMAIN_ID, CYCLONEDDS_URI)"
        yield Finding(name, Level.FAIL, f"{status.hand} reaches no Nav2 on DDS", remedy)
    elif status.hand_servers > 1:
        yield Finding(name, Level.FAIL, f"{status.hand} sees {status.hand_servers} Nav2 servers", "leave one running")
    else:
        yield Finding(name, Level.OK, f"{status.hand} reaches Nav2 on DDS")


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
