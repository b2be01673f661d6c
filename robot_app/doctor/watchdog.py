"""The doctor's checks of the robot's watchdog, by its own word."""

from __future__ import annotations

from collections.abc import Iterator

from drivers.watchdog.latch import WatchdogState
from robot_app.doctor.finding import Examined, Finding, Level


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
