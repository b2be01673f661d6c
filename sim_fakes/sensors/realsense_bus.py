"""The simulated D435i on its bus, and the device that streams in real time in the camera's own process."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from typing import Any

from drivers.clock import SystemClock
from drivers.ports import Clock
from drivers.realsense.bus import open_attached
from sim_fakes.sensors.realsense_faults import Fault, TwinState
from sim_fakes.sensors.realsense_software import PERIOD_NS, Images, RealSenseTwin, TwinSpec

RESET_S = 0.2  # a real one takes 3 to 6 s to come back


class TwinOnBus:
    """The rs.device of a twin, which a software device lacks the reset for."""

    def __init__(self, bus: TwinBus, twin: RealSenseTwin) -> None:
        self._bus, self._twin = bus, twin

    def hardware_reset(self) -> None:
        self._bus.reset()

    def is_connected(self) -> bool:
        return self._twin.state.fault is not Fault.UNPLUGGED

    def __getattr__(self, name: str) -> Any:
        return getattr(self._twin.device, name)


class TwinBus:
    """The twin's bus (drivers.realsense.bus.Bus): lists the twin, unless unplugged or on its way back from a reset."""

    def __init__(self, twin: RealSenseTwin, clock: Clock) -> None:
        self._device, self._state, self._clock = TwinOnBus(self, twin), twin.state, clock
        self._serial = twin.spec.serial
        self._back_ns = 0

    def devices(self) -> list[tuple[str, Any]]:
        gone = self._state.fault is Fault.UNPLUGGED or self._clock.now_ns() < self._back_ns
        return [] if gone else [(self._serial, self._device)]

    def reset(self) -> None:
        self._state.count_reset()
        self._back_ns = self._clock.now_ns() + round(RESET_S * 1e9)


def open_twin(make_images: Callable[[TwinSpec], Images], spec: TwinSpec, state: TwinState, *, reset: bool) -> Any:
    """An OpenDevice for the camera's process, with all but `reset` bound: a twin that streams in real time.

    make_images is called there, so that it, not what it makes, has to be picklable.
    """
    state.count_opening()
    twin = RealSenseTwin(make_images(spec), spec, state)
    device = open_attached(TwinBus(twin, SystemClock()), spec.serial, SystemClock(), reset=reset)
    threading.Thread(target=_feed_forever, args=(twin,), daemon=True).start()
    return device


def _feed_forever(twin: RealSenseTwin) -> None:
    due_ns = time.monotonic_ns()
    while True:
        if twin.state.fault is Fault.HANG:
            os.kill(os.getpid(), signal.SIGSTOP)
        if twin.state.fault is Fault.CRASH:
            os._exit(1)
        twin.feed(time.time_ns())
        due_ns = max(due_ns + PERIOD_NS, time.monotonic_ns())
        time.sleep(max(due_ns - time.monotonic_ns(), 0) / 1e9)
