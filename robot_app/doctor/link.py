"""The doctor's checks of the link to a robot: the wire, and the bridge at its other end."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterator

from drivers.nav2.bridge_age import LEAST, TESTED, bridge_versions, said
from drivers.ports import PortError
from robot_app.doctor.finding import Examined, Finding, Level

MEND = {  # by the sign of Nav2 that is missing
    "link": "check the network, and the bridge on the robot",
    "action server": "start Nav2 with CycloneDDS, and let the bridge forward its actions",
    "active": "bring Nav2 up (ros2 launch nav2_bringup ...); lifecycle_manager_navigation's log says what holds it",
    "pose": "start localisation, and give it a first pose",
    "map": "start map_server, and let the bridge forward /map",
}


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
