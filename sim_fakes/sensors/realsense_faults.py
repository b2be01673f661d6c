"""What goes wrong with a simulated D435i, and what survives its camera's process."""

from __future__ import annotations

from enum import IntEnum
from multiprocessing import get_context


class Fault(IntEnum):
    """What goes wrong. A hardware reset mends all but UNPLUGGED."""

    NONE = 0
    DROPPED = 1  # every third colour image is lost
    LATE = 2  # colour images come 50 ms late
    REPEATED = 3  # the last images again: number, stamp and pixels
    STAMP_FROZEN = 4  # new numbers, old stamps
    PIXELS_FROZEN = 5  # new numbers and stamps, old pixels
    SILENT = 6  # nothing comes, the device stays on the bus
    UNPLUGGED = 7
    HANG = 8  # the process stands still, as inside an SDK call that never returns
    CRASH = 9  # the process dies


class TwinState:
    """What survives the camera's process, shared with the test: the fault, and how often things happened."""

    def __init__(self) -> None:
        self._numbers = get_context("spawn").RawArray("i", 3)

    @property
    def fault(self) -> Fault:
        return Fault(self._numbers[0])

    @fault.setter
    def fault(self, fault: Fault) -> None:
        self._numbers[0] = fault

    @property
    def resets(self) -> int:
        return int(self._numbers[1])

    @property
    def openings(self) -> int:
        return int(self._numbers[2])

    def count_reset(self) -> None:
        self._numbers[1] += 1
        if self.fault is not Fault.UNPLUGGED:
            self.fault = Fault.NONE

    def count_opening(self) -> None:
        self._numbers[2] += 1
