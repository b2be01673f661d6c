"""Finding the camera on the bus, and bringing it back with a hardware reset. What fails is named; every wait ends."""

from __future__ import annotations

from typing import Any, Protocol

from drivers.ports import Clock
from drivers.realsense.messages import CameraGone, CameraRefused

GONE_S, BACK_S = 3.0, 12.0  # after a hardware reset: until it leaves the bus, until it is back
LOOK_EVERY_S = 0.1


class Bus(Protocol):
    """This machine's USB, or its simulated twin."""

    def devices(self) -> list[tuple[str, Any]]:
        """(serial number, rs.device) of every RealSense there."""
        ...


def open_attached(bus: Bus, serial: str | None, clock: Clock, *, reset: bool) -> Any:
    """The rs.device on the bus; serial None takes the only one. reset: wait for it, reset it, wait again.

    Raises CameraRefused where none or several are there, CameraGone where it does not come (back) in time.
    """
    if not reset:
        device = _found(bus, serial)
        if device is None:
            raise CameraRefused(f"No RealSense{_named(serial)} is connected: check the cable and the USB port.")
        return device
    _awaited(bus, serial, clock).hardware_reset()
    _until_gone(bus, serial, clock)
    return _awaited(bus, serial, clock)


def _found(bus: Bus, serial: str | None) -> Any | None:
    found = [(number, device) for number, device in bus.devices() if serial in (None, number)]
    if len(found) > 1:
        serials = ", ".join(number for number, _ in found)
        raise CameraRefused(f"Several RealSense cameras are connected ({serials}): set the serial of the one to use.")
    return found[0][1] if found else None


def _awaited(bus: Bus, serial: str | None, clock: Clock) -> Any:
    for _ in range(round(BACK_S / LOOK_EVERY_S)):
        device = _found(bus, serial)
        if device is not None:
            return device
        clock.sleep(LOOK_EVERY_S)
    raise CameraGone(f"the RealSense{_named(serial)} has left the USB bus: check the cable")


def _until_gone(bus: Bus, serial: str | None, clock: Clock) -> None:
    """A reset device leaves the bus first; one that never left was back before we looked."""
    for _ in range(round(GONE_S / LOOK_EVERY_S)):
        if _found(bus, serial) is None:
            return
        clock.sleep(LOOK_EVERY_S)


def _named(serial: str | None) -> str:
    return "" if serial is None else f" with serial number {serial}"
