"""The life of one sensor in `openbelief onboard`: opened, published, and after any trouble opened anew."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Protocol

from drivers.clock import SystemClock
from drivers.ports import PortError
from drivers.ros.diagnosis import Diagnosis, Severity
from drivers.ros.publish import Publisher
from logs.structured import logger

STEP_S = 0.005
LOOK_S = 1.0  # how often it is asked what is wrong, and whether the system clock was set
BACK_OFF_S = (1.0, 2.0, 5.0, 10.0, 30.0)  # between attempts, the last again and again: it may be plugged in any time
PROVEN_S = 30.0  # after so long at work earlier failures are forgotten
CLOCK_SET_S = 0.5


class ClockWasSet(PortError):
    """Stamps that were made since are wrong by as much."""


@dataclass(frozen=True)
class Opened:
    """A sensor at work. diagnose: what is wrong with it just now, or that nothing is."""

    publishers: Sequence[Publisher]
    diagnose: Callable[[], Sequence[Diagnosis]] = tuple


class OpenSensor(Protocol):
    def __call__(self, clock: SystemClock, opened: ExitStack) -> Opened:
        """Open it, for as long as `opened` is; may take long. Raises PortError where it cannot be."""
        ...


class Sensing:
    """`run()` returns when `wait` does: True once we are to stop, else after that many seconds.

    Whatever a sensor does stays in here: trouble is logged once per change, the sensor is closed and after a while
    opened anew. So is it when the system clock was set by more than 0.5 s: durations keep their monotonic clock as long
    as the sensor is open, and its stamps are wrong for no longer than that takes.
    """

    def __init__(
        self,
        name: str,
        open_sensor: OpenSensor,
        wait: Callable[[float], bool],
        make_clock: Callable[[], SystemClock] = SystemClock,
    ) -> None:
        self._name, self._open, self._wait, self._make_clock = name, open_sensor, wait, make_clock
        self._failures, self._told = 0, ""
        self._complaints: frozenset[str] = frozenset()

    def run(self) -> None:
        while True:
            clock = self._make_clock()
            began_ns = clock.now_ns()
            if self._serve(clock):
                return
            if clock.now_ns() - began_ns >= PROVEN_S * 1e9:
                self._failures = 0
            pause_s = BACK_OFF_S[min(self._failures, len(BACK_OFF_S) - 1)]
            self._failures += 1
            if self._wait(pause_s):
                return

    def _serve(self, clock: SystemClock) -> bool:
        """One opening, to its end; True where we are to stop."""
        try:
            with ExitStack() as opened:
                sensor = self._open(clock, opened)
                self._say("open")
                self._publish(sensor, clock)
                return True
        except PortError as error:
            self._say(str(error))
        except Exception as error:  # noqa: BLE001 - a fault of ours; it must stop neither this sensor nor the others
            self._say(f"{type(error).__name__}: {error}", error)
        return False

    def _publish(self, sensor: Opened, clock: SystemClock) -> None:
        look_ns = 0
        while not self._wait(STEP_S):
            for publisher in sensor.publishers:
                publisher.step()
            if clock.now_ns() >= look_ns:
                look_ns = clock.now_ns() + round(LOOK_S * 1e9)
                self._look(sensor, clock)

    def _look(self, sensor: Opened, clock: SystemClock) -> None:
        if abs(by_s := clock.set_by_s()) > CLOCK_SET_S:
            raise ClockWasSet(f"The system clock was set by {by_s:+.1f} s: the {self._name} begins anew.")
        complaints = frozenset(str(found) for found in sensor.diagnose() if found.severity is not Severity.OK)
        for sentence in sorted(complaints - self._complaints):
            logger().warning("sensor", sensor=self._name, says=sentence)
        self._complaints = complaints

    def _say(self, what: str, cause: Exception | None = None) -> None:
        """Once per change."""
        if what == self._told:
            return
        self._told = what
        if what == "open":
            logger().info("sensor", sensor=self._name, state=what)
        else:
            logger().error("sensor", sensor=self._name, reason=what, exc_info=cause)
