"""Finding the camera and resetting it, on a moved clock."""

from __future__ import annotations

from typing import Any

import pytest

from drivers.clock import SimClock
from drivers.realsense.bus import BACK_S, open_attached
from drivers.realsense.messages import CameraGone, CameraRefused
from sim_fakes.sensors.realsense_bus import TwinBus
from sim_fakes.sensors.realsense_faults import Fault
from sim_fakes.sensors.realsense_software import RealSenseTwin, TwinSpec, box_images

START_NS = 1_700_000_000_000_000_000


class Buses:
    """Several twins on one USB."""

    def __init__(self, *buses: TwinBus) -> None:
        self._buses = buses

    def devices(self) -> list[tuple[str, Any]]:
        return [device for bus in self._buses for device in bus.devices()]


@pytest.fixture
def clock() -> SimClock:
    return SimClock(START_NS)


def twin(serial: str = "1") -> RealSenseTwin:
    spec = TwinSpec(serial=serial)
    return RealSenseTwin(box_images(spec), spec)


def test_the_only_camera_needs_no_serial(clock) -> None:
    assert open_attached(TwinBus(twin(), clock), None, clock, reset=False)


def test_no_camera_is_refused_at_once(clock) -> None:
    with pytest.raises(CameraRefused, match="No RealSense with serial number 2"):
        open_attached(TwinBus(twin("1"), clock), "2", clock, reset=False)
    assert clock.now_ns() == START_NS


def test_two_cameras_need_a_serial(clock) -> None:
    both = Buses(TwinBus(twin("1"), clock), TwinBus(twin("2"), clock))
    with pytest.raises(CameraRefused, match=r"Several.*\(1, 2\)"):
        open_attached(both, None, clock, reset=False)
    assert open_attached(both, "2", clock, reset=False) is both.devices()[1][1]


def test_a_reset_waits_until_the_camera_is_back(clock) -> None:
    one = twin()
    bus = TwinBus(one, clock)
    one.state.fault = Fault.SILENT
    assert open_attached(bus, "1", clock, reset=True) is bus.devices()[0][1]
    assert one.state.resets == 1 and one.state.fault is Fault.NONE
    assert clock.now_ns() > START_NS


def test_a_camera_that_does_not_come_back_is_given_up_in_time(clock) -> None:
    one = twin()
    one.state.fault = Fault.UNPLUGGED
    with pytest.raises(CameraGone, match="left the USB bus"):
        open_attached(TwinBus(one, clock), "1", clock, reset=True)
    assert (clock.now_ns() - START_NS) / 1e9 == pytest.approx(BACK_S, abs=0.2)
