"""What a driver lost before a recorder could take it, counted from the recording's beginning, by where it was lost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

# A driver's own counter -> where that is, in the operator's words. Of RealSenseHealth.counts and LivoxHealth.
CAMERA_COUNTS = {
    "lost": "never came whole from the camera",
    "no_slot": "found the camera's process without a free slot: this machine was slow",
}
LIDAR_COUNTS = {
    "lost": "packets lost on the network",
    "late": "packets too late for their cloud",
    "overfull": "clouds without an end",
    "cut": "packets left out because the lidar's clock was set",
    "refused": "packets refused",
}
LIDAR_IMU_COUNTS = {"imu_lost": "packets lost on the network"}
NOT_TAKEN = "were not taken from the driver in time"


@runtime_checkable
class TellsHealth(Protocol):
    def health(self) -> Any: ...


@runtime_checkable
class TakesImu(Protocol):
    def take_imu(self) -> Sequence[Any]: ...


class Growth:
    """How far counters have grown since this began.

    begins_anew: a counter that falls has begun anew (a restarted camera process); else it was corrected.
    """

    def __init__(self, read: Callable[[], Mapping[str, int]], *, begins_anew: bool = False) -> None:
        self._read, self._begins_anew = read, begins_anew
        self._last, self._grown = Counter(read()), Counter[str]()

    def look(self) -> dict[str, int]:
        now = self._read()
        for name, count in now.items():
            step = count - self._last[name]
            self._grown[name] += count if step < 0 and self._begins_anew else step
        self._last = Counter(now)
        return {name: count for name, count in self._grown.items() if count > 0}


class Numbers:
    """Numbers that a driver gives what it hands over: a gap is something that was not taken in time."""

    def __init__(self) -> None:
        self.missing = 0
        self._last: int | None = None

    def see(self, numbers: Sequence[int]) -> None:
        """Those of one batch. Of the first, only the last counts: what was before is not of this recording."""
        if self._last is None:
            self._last = numbers[-1] if numbers else None
            return
        for number in numbers:
            self.missing += max(number - self._last - 1, 0)
            self._last = number


class CameraLosses:
    """A camera's driver knows what its own process lost; gaps in `color_number` beyond that are ours."""

    def __init__(self, camera: object) -> None:
        self._numbers = Numbers()
        self._growth = Growth(_reader(camera, CAMERA_COUNTS, "counts"), begins_anew=True)

    def took(self, frames: Sequence[Any]) -> None:
        self._numbers.see([frame.color_number for frame in frames if hasattr(frame, "color_number")])

    def look(self) -> dict[str, int]:
        known = self._growth.look()
        return known | _if_any(self._numbers.missing - sum(known.values()))


class CloudLosses:
    """Packets that the lidar's driver missed, and clouds that were not taken (gaps in `sequence`)."""

    def __init__(self, lidar: object) -> None:
        self._numbers = Numbers()
        self._growth = Growth(_reader(lidar, LIDAR_COUNTS))

    def took(self, clouds: Sequence[Any]) -> None:
        self._numbers.see([cloud.sequence for cloud in clouds if hasattr(cloud, "sequence")])

    def look(self) -> dict[str, int]:
        return self._growth.look() | _if_any(self._numbers.missing)


class ImuLosses:
    """IMU packets that the driver missed, and samples that it received and nobody took in time.

    A camera's driver does not count its IMU: there the holes in the stamps tell.
    """

    def __init__(self, sensor: TakesImu) -> None:
        self._sensor = sensor
        self._growth = Growth(_reader(sensor, LIDAR_IMU_COUNTS))
        self._received = _reader(sensor, {"imu_packets": "received"})
        self._taken: int | None = None
        self._not_taken = 0

    def take(self) -> Sequence[Any]:
        """What was received is read before the taking: what comes between the two is no loss."""
        received = self._received().get("received", 0)
        samples = self._sensor.take_imu()
        if self._taken is None:
            self._taken = self._received().get("received", 0)  # what came before is not of this recording
        else:
            self._taken += len(samples)
        self._not_taken = max(self._not_taken, received - self._taken)
        return samples

    def look(self) -> dict[str, int]:
        return self._growth.look() | _if_any(self._not_taken)


def _reader(driver: object, table: Mapping[str, str], part: str = "") -> Callable[[], dict[str, int]]:
    """Reads the table's counters from a driver's health; nothing where it has none."""
    if not isinstance(driver, TellsHealth):
        return dict

    def read() -> dict[str, int]:
        health = driver.health()
        counts = getattr(health, part, None) if part else health
        return {where: _number(getattr(counts, name)) for name, where in table.items() if hasattr(counts, name)}

    return read


def _number(count: int | Mapping[str, int]) -> int:
    return count if isinstance(count, int) else sum(count.values())


def _if_any(count: int) -> dict[str, int]:
    return {NOT_TAKEN: count} if count > 0 else {}
