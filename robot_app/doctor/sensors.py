"""The doctor's checks of a sensor at this machine: what only its own driver can tell."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack

from drivers.clock import SystemClock
from drivers.livox.diagnosis import diagnoses
from drivers.livox.driver import LivoxLidar
from drivers.ports import PortError
from drivers.realsense.camera import RealSenseCamera
from drivers.realsense.messages import FPS
from drivers.ros.diagnosis import Diagnosis, Severity
from drivers.topics import LIDAR
from robot_app.config import Config
from robot_app.doctor.finding import Finding, Level
from robot_app.doctor.topic_probe import TopicProbe
from robot_app.local_sensors import open_livox, open_realsense

LISTEN_S = 3.0
SENSOR_AGE_S = {"camera": 2.0, "lidar": 1.0}
LOSS_WARN = 0.01
SLOW = 0.8  # of the rate it should have
LEVELS = {Severity.OK: Level.OK, Severity.WARN: Level.WARN, Severity.ERROR: Level.FAIL}


def fresh(port: str, word: str, latest: Callable[[float], object]) -> Iterator[Finding]:
    """Whether the port gives data as a mission would take it. word: what stands for it in robot.toml."""
    max_age_s = SENSOR_AGE_S[port]
    try:
        latest(max_age_s)
    except PortError as error:
        yield Finding(
            port, Level.FAIL, str(error), f'is the {port} running, and is {port} = "{word}" what stands there?'
        )
    else:
        yield Finding(port, Level.OK, f"data newer than {max_age_s:g} s")


def counter(sensor: object) -> Callable[[], int] | None:
    """How many images or clouds its driver has had so far; None where it is no sensor of this machine."""
    if isinstance(sensor, RealSenseCamera):
        return lambda: sensor.health().counts.frames
    if isinstance(sensor, LivoxLidar):
        return lambda: sensor.health().clouds
    return None


def check_real_camera(camera: RealSenseCamera, ears: TopicProbe) -> Iterator[Finding]:
    info, health = camera.info, camera.health()
    fast = info.usb.startswith("3")
    remedy = "" if fast else "take a USB 3 cable and port: USB 2 cannot carry depth and colour"
    yield Finding("camera usb", Level.OK if fast else Level.FAIL, f"{info.name} at USB {info.usb}", remedy)
    counts = health.counts
    rest = f"{counts.lost} lost, {counts.unpaired} unpaired, {counts.frozen} frozen, {health.restarts} restarts"
    yield _rate("camera", ears, FPS, rest, "another USB port, nothing else on its bus, a machine with less to do")


def check_real_lidar(lidar: LivoxLidar, ears: TopicProbe) -> Iterator[Finding]:
    health = lidar.health()
    lost = health.lost / max(health.packets + health.lost, 1)
    level = Level.WARN if lost > LOSS_WARN or health.refused else Level.OK
    remedy = "" if level == Level.OK else "sudo sysctl -w net.core.rmem_max=8388608, and look for a busy network"
    yield Finding("lidar loss", level, f"{100 * lost:.2f} % of {health.packets} packets lost", remedy)
    yield _rate("lidar", ears, LIDAR.rate_hz or 0.0, f"{health.late} packets late", "look at the cable and the switch")
    yield from lines_of(diagnoses(health.state))


def lines_of(found: Sequence[Diagnosis]) -> Iterator[Finding]:
    for each in found:
        yield Finding(each.name, LEVELS[each.severity], each.said, each.remedy)


def _rate(port: str, ears: TopicProbe, nominal_hz: float, rest: str, remedy: str) -> Finding:
    rate_hz = ears.counted_hz(port)
    slow = rate_hz < SLOW * nominal_hz
    said = f"{rate_hz:.1f} of {nominal_hz:g} Hz, {rest}"
    return Finding(f"{port} rate", Level.WARN if slow else Level.OK, said, remedy if slow else "")


def examine_local(config: Config) -> Iterator[Finding]:
    """The sensors that robot.toml calls "real", each by itself: for when the robot they belong to cannot be opened."""
    clock = SystemClock()
    for port, (open_sensor, check) in LOCAL.items():
        if getattr(config.ports, port) != "real":
            continue
        with ExitStack() as opened:
            try:
                sensor = open_sensor(config, clock, opened)
            except PortError as error:
                yield Finding(port, Level.FAIL, str(error), f'mend that, or name another {port} in [ports] than "real"')
                continue
            ears = TopicProbe(clock)
            if counted := counter(sensor):
                ears.count(port, counted)
            ears.listen(LISTEN_S)
            yield from fresh(port, "real", sensor.latest)
            yield from check(sensor, ears)


# port -> (how it is opened, what is looked at)
LOCAL: dict[str, tuple[Callable, Callable]] = {
    "camera": (open_realsense, check_real_camera),
    "lidar": (open_livox, check_real_lidar),
}
