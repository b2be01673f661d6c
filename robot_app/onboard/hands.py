"""Which second way to Nav2 the watchdog has on this robot: cyclonedds, the helper under ROS, or none."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack

from drivers.dds.raw import DdsPeer, DdsUnavailable, dds_installed, ros_domain
from drivers.watchdog.hands import DdsHand, Hand
from drivers.watchdog.ros_hand import RosHelperHand, helper_command
from robot_app.config import Config

NONE = (
    "The watchdog cannot stop the robot where the bridge is gone: pip install 'openbelief[dds]', or on ARM name ROS's "
    "set-up file in [onboard] ros_setup."
)


def open_hand(config: Config, opened: ExitStack, tell: Callable[[str], None]) -> Hand | None:
    """As long as `opened` is. None where there is none or it cannot be opened: it is told, the watchdog goes on."""
    word = config.onboard.dds
    if word == "auto":
        word = "cyclonedds" if dds_installed() else "ros" if config.onboard.ros_setup else "off"
    try:
        return HANDS[word](config, opened)
    except DdsUnavailable as error:
        tell(str(error))
        return None


def _cyclonedds(_config: Config, opened: ExitStack) -> Hand:
    """The bridge's namespace is Zenoh's alone: on DDS names are as ROS has them."""
    return DdsHand(opened.enter_context(DdsPeer(ros_domain())))


def _ros(config: Config, opened: ExitStack) -> Hand:
    return opened.enter_context(RosHelperHand(helper_command(config.onboard.ros_setup)))


def _none(_config: Config, _opened: ExitStack) -> Hand:
    raise DdsUnavailable(NONE)


HANDS: dict[str, Callable[[Config, ExitStack], Hand]] = {"cyclonedds": _cyclonedds, "ros": _ros, "off": _none}
