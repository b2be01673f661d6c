"""On the robot: the watchdog that stops it when the workstation is gone, and its sensors as ROS topics over Zenoh.

Runs until Ctrl-C or SIGTERM; let systemd start it again. When a workstation's heartbeat is silent for 0.7 s or its
liveliness token goes, every navigation goal is cancelled and the watchdog is latched: no goal runs until a person has
looked at the robot and resets it (--reset, on the robot or at the workstation). A reset moves nothing. The watchdog is
software over a network: the hand-held remote is the emergency stop.
"""

from __future__ import annotations

import argparse
import signal
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import Failure, print_json, shown

if TYPE_CHECKING:
    from robot_app.config import Config

EXAMPLE = "openbelief onboard --config demo-out/robot.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--config", type=Path, default=Path("robot.toml"), metavar="robot.toml", help="default robot.toml"
    )
    parser.add_argument(
        "--reset", action="store_true", help="release the latch of the watchdog that runs on the robot, and end"
    )


def run(options: argparse.Namespace) -> int:
    from drivers.clock import SystemClock
    from drivers.ports import PortError
    from logs.structured import configure
    from robot_app.config import ConfigError, load_config
    from robot_app.onboard.process import run_onboard

    try:
        config = load_config(options.config)
        if options.reset:
            return _reset(config, as_json=options.json)
        configure(SystemClock())
        stop = threading.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: stop.set())
        run_onboard(config, stop, lambda sentence: print(shown(sentence), file=sys.stderr, flush=True))
    except (ConfigError, PortError, OSError) as error:
        raise Failure(str(error)) from error
    if options.json:
        print_json({"ended": "by a signal"})
    return 0


def _reset(config: Config, *, as_json: bool) -> int:
    from drivers.ros.bridge_keys import BridgeKeys
    from drivers.ros.zenoh_link import LinkConfig, ZenohLink
    from drivers.watchdog.heartbeat import WatchdogView
    from logs.structured import neutralise

    with ZenohLink(LinkConfig((config.zenoh.endpoint,), tls=config.zenoh.tls)) as link:
        reply = WatchdogView(link, BridgeKeys(config.zenoh.namespace)).reset()
    if as_json:
        print_json(reply.model_dump())
    if not reply.ok:
        raise Failure(f"The watchdog stays latched: {reply.reason}.")
    if not as_json:
        print(neutralise(f"The watchdog is reset{f' ({reply.reason})' if reply.reason else ''}."))
    return 0
