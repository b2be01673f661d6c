"""Make the keys of a robot's network: an authority, certificates for its machines, and the configurations with them.

Writes one folder for each machine: copy each to its machine, and no other. The authority's key (ca.key) makes further
certificates: keep it off the robot and off the network. Nothing is ever overwritten: to begin anew, name a new folder.
"""

from __future__ import annotations

import argparse
import ipaddress
import re
from collections.abc import Callable
from pathlib import Path

from robot_app.cli import Failure, print_json

NAMESPACE = re.compile(r"/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*|/?", re.ASCII)  # ROS 2's rule for names
PLACE = re.compile(r"(/[\w.+@-]+)+/?", re.ASCII)
EXAMPLE = "openbelief certs -o g1-certs --robot 192.168.123.164"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="a new folder")
    parser.add_argument(
        "--robot", type=_address, required=True, metavar="ADDRESS", help="the robot's, where it listens"
    )
    parser.add_argument(
        "--name", type=_host, action="append", default=[], metavar="HOST", help="another name of the robot (again)"
    )
    parser.add_argument(
        "--console",
        type=_host,
        action="append",
        default=[],
        metavar="HOST",
        help="where browsers reach the operator's page (again for more)",
    )
    parser.add_argument("--port", type=int, default=7447, help="default 7447")
    parser.add_argument(
        "--namespace", type=_matching(NAMESPACE, "/g1"), default="", help='the bridge\'s, like "/g1" (default: none)'
    )
    parser.add_argument("--days", type=int, default=365, help="how long they are valid (default 365)")
    parser.add_argument(
        "--installed",
        type=_matching(PLACE, "/etc/openbelief"),
        default="/etc/openbelief",
        metavar="DIR",
        help="the folder's place on the robot (default /etc/openbelief)",
    )


def run(options: argparse.Namespace) -> int:
    from drivers.clock import SystemClock
    from robot_app.certs.folder import make_network
    from robot_app.certs.zenoh import ZenohNetwork

    if not (1 <= options.days <= 3650 and 1 <= options.port <= 65534):
        raise Failure("--days must be 1 to 3650 and --port 1 to 65534")
    network = ZenohNetwork(options.robot, options.port, options.namespace, options.installed.rstrip("/"))
    try:
        written = make_network(
            options.output, network, options.name, SystemClock().now_ns(), options.days, options.console
        )
    except FileExistsError as error:
        raise Failure(f"{options.output} exists: keys are never overwritten, name a new folder") from error
    except (OSError, ValueError) as error:
        raise Failure(f"{options.output}: {error}") from error
    if options.json:
        print_json({"folder": str(options.output), "files": [str(path) for path in written]})
    else:
        print("\n".join(map(str, written)))
        print(f"Copy {options.output}/robot to {options.installed} on the robot, each other folder to its machine.")
    return 0


def _host(text: str) -> str:
    from robot_app.certs.certificates import require_host

    try:
        return require_host(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _matching(pattern: re.Pattern[str], example: str) -> Callable[[str], str]:
    def check(text: str) -> str:
        if not pattern.fullmatch(text):
            raise argparse.ArgumentTypeError(f"something like {example} is needed, got {text!r}")
        return text

    return check


def _address(text: str) -> str:
    """One address: a robot never listens on all of its interfaces."""
    try:
        address = ipaddress.ip_address(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"an address like 192.168.123.164 is needed, got '{text}'") from error
    if address.is_unspecified or address.is_multicast or address.version != 4:
        raise argparse.ArgumentTypeError(f"name one IPv4 address of the robot's, got '{text}'")
    return text
