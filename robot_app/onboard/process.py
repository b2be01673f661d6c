"""The small process on the robot: the watchdog, and the sensors as ROS topics where no ROS node publishes them."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import ExitStack

from drivers.ports import LinkLost, PortError
from drivers.repeats import Repeats
from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.zenoh_link import LinkConfig, ZenohLink
from drivers.watchdog.guard import WatchdogGuard
from logs.structured import logger
from robot_app.config import Config
from robot_app.onboard.hands import open_hand
from robot_app.onboard.sensing import OpenSensor, Sensing
from robot_app.onboard.sensors import sensors

WATCH_S = 0.02  # the watchdog looks 50 times a second
RECONNECT_S = 2.0
CLOSE_S = 5.0  # for the sensors to close; one that is just being opened is left to the end of the process


def run_onboard(config: Config, stop: threading.Event, tell: Callable[[str], None]) -> None:
    """Until `stop`. Raises LinkLost where the session to the bridge closed.

    The watchdog has the calling thread and begins before anything else; each sensor has a thread of its own, in which
    it is opened too, so that its trouble reaches neither the watchdog nor the other sensors.
    """
    link_config = LinkConfig((config.zenoh.endpoint,), tls=config.zenoh.tls)
    with ExitStack() as opened:
        link = _connected(link_config, stop, tell, opened)
        if link is None:
            return
        hand = open_hand(config, opened, tell)
        guard = WatchdogGuard(
            link, BridgeKeys(config.zenoh.namespace), distribution=config.zenoh.distribution, hand=hand
        )
        guard.start()
        tell(f"The watchdog watches through {config.zenoh.endpoint}.")
        for name, open_sensor in sensors(config, link):
            _begin(name, open_sensor, stop, opened)
        opened.callback(stop.set)
        repeats = Repeats()
        while not stop.wait(WATCH_S):
            _step(guard, repeats)


def _begin(name: str, open_sensor: OpenSensor, stop: threading.Event, opened: ExitStack) -> None:
    sensing = threading.Thread(target=Sensing(name, open_sensor, stop.wait).run, name=name, daemon=True)
    sensing.start()
    opened.callback(sensing.join, CLOSE_S)


def _connected(
    config: LinkConfig, stop: threading.Event, tell: Callable[[str], None], opened: ExitStack
) -> ZenohLink | None:
    """The bridge may start after us; None where `stop` came first."""
    told = ""
    while not stop.is_set():
        try:
            return opened.enter_context(ZenohLink(config))
        except LinkLost as error:
            if str(error) != told:
                tell(told := str(error))
        stop.wait(RECONNECT_S)
    return None


def _step(guard: WatchdogGuard, repeats: Repeats) -> None:
    """A message that a handler failed on is logged: the watchdog watches on. A closed session ends the process."""
    try:
        guard.step()
    except LinkLost:
        raise
    except PortError as error:
        if count := repeats.due(str(error)):
            logger().error("watchdog_handler", reason=str(error), times=count)
