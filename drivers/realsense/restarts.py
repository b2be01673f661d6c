"""When the camera's process is stopped, started again, and given up. Pure: time is an argument."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class ProcessPhase(StrEnum):
    RESTING = "resting"  # no process; the next one starts at a known time
    OPENING = "opening"
    STREAMING = "streaming"
    FAILED = "failed"


class RestartAction(StrEnum):
    NOTHING = "nothing"
    START = "start"
    STOP = "stop"


@dataclass(frozen=True, kw_only=True)
class RestartLimits:
    """Seconds. A miss is `miss_s` without a new image; after `misses` of them the process is stopped.

    open_s covers a hardware reset (6 s) and enumeration. hang_s: not even a sign of life, of which there are ten a
    second. Restarts wait `back_off_s` in turn; after the last the camera has failed. `proven_s` of streaming forgets
    earlier failures.
    """

    misses: int = 4
    miss_s: float = 0.25
    first_image_s: float = 5.0
    open_s: float = 25.0
    hang_s: float = 0.8
    back_off_s: tuple[float, ...] = (0.5, 1.0, 2.0, 4.0, 8.0)
    proven_s: float = 30.0


class RestartPolicy:
    """Told what happens to the camera's process; `due` says what to do now, `reason` why."""

    def __init__(self, limits: RestartLimits) -> None:
        self._limits = limits
        self.phase = ProcessPhase.RESTING
        self.reason = "it was not started yet"
        self.failures = 0  # in a row
        self.restarts = 0  # ever
        self._since_ns = self._alive_ns = self._image_ns = 0
        self._any_image = self._permanent = False
        self._frozen = self._frozen_before = 0

    def due(self, now_ns: int) -> RestartAction:
        if self.phase is ProcessPhase.RESTING and now_ns >= self._since_ns:
            return RestartAction.START
        complaint = self._complaint(now_ns)
        if complaint is None:
            return RestartAction.NOTHING
        self.reason = complaint
        return RestartAction.STOP

    def started(self, now_ns: int) -> None:
        self.phase, self._since_ns, self._any_image = ProcessPhase.OPENING, now_ns, False
        self.restarts += self.failures > 0

    def opened(self, now_ns: int) -> None:
        self.phase, self._since_ns = ProcessPhase.STREAMING, now_ns
        self._alive_ns = self._image_ns = now_ns
        self._frozen = self._frozen_before = 0

    def alive(self, now_ns: int, frozen: int) -> None:
        """frozen: images turned away so far because they were not new."""
        self._alive_ns, self._frozen = now_ns, frozen

    def image(self, now_ns: int) -> None:
        self._alive_ns = self._image_ns = now_ns
        self._any_image, self._frozen_before = True, self._frozen
        if now_ns - self._since_ns >= self._limits.proven_s * 1e9:
            self.failures = 0

    def ended(self, now_ns: int, reason: str, *, permanent: bool = False) -> None:
        """The process is gone. Restart later, or give up."""
        self.failures += 1
        self.reason = reason
        self._permanent = permanent
        if permanent or self.failures > len(self._limits.back_off_s):
            self.phase = ProcessPhase.FAILED
            return
        self.phase = ProcessPhase.RESTING
        self._since_ns = now_ns + round(self._limits.back_off_s[self.failures - 1] * 1e9)

    def verdict(self) -> str:
        """The last word, once it has failed."""
        if self._permanent:
            return self.reason
        return (
            f"The camera has failed, {self.failures - 1} hardware resets did not help: {self.reason}. "
            "Unplug it, plug it in again, and restart the program."
        )

    def _complaint(self, now_ns: int) -> str | None:
        limits = self._limits
        if self.phase is ProcessPhase.OPENING and now_ns - self._since_ns > limits.open_s * 1e9:
            return f"it did not open within {limits.open_s:g} s"
        if self.phase is not ProcessPhase.STREAMING:
            return None
        silent_s = (now_ns - self._alive_ns) / 1e9
        if silent_s > limits.hang_s:
            return f"its process gave no sign of life for {silent_s:.1f} s (librealsense hangs)"
        patience_s = limits.misses * limits.miss_s if self._any_image else limits.first_image_s
        if now_ns - self._image_ns > patience_s * 1e9:
            frozen = " (what comes is frozen)" if self._frozen > self._frozen_before else ""
            return f"no new image came for {patience_s:g} s{frozen}"
        return None
