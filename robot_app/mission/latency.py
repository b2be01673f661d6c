"""How long a look takes while a robot waits for it: logged stage by stage, against a budget."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.ports import Clock
from logs.structured import logger
from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.stages import StagedPerception, in_turn


class WatchedPerception:
    """Perception port: the same masks, and a line in the log for every look, a warning where it took too long."""

    def __init__(self, perception: StagedPerception, clock: Clock, *, budget_s: float) -> None:
        self.id, self.feature_text_aligned = perception.id, perception.feature_text_aligned
        self._perception, self._clock, self._budget_s = perception, clock, budget_s

    @property
    def text_space(self) -> str | None:
        """Id of the text encoder in whose space the features live."""
        return getattr(self._perception, "text_space", None)

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        """Raises what a stage raises; how far it came is logged then too."""
        seconds: dict[str, float] = {}
        try:
            return in_turn(self._perception.stages, frame, lambda stage: self._timed(stage, seconds))
        finally:
            self._log(frame, seconds)

    @contextmanager
    def _timed(self, stage: str, seconds: dict[str, float]) -> Iterator[None]:
        start_ns = self._clock.now_ns()
        try:
            yield
        finally:
            seconds[stage] = round((self._clock.now_ns() - start_ns) / 1e9, 4)

    def _log(self, frame: RgbdFrame, seconds: dict[str, float]) -> None:
        total_s = sum(seconds.values())
        late = total_s > self._budget_s
        say = logger().warning if late else logger().info
        say(
            "perception_late" if late else "perception_took",
            frame_stamp_ns=frame.stamp_ns,
            seconds=seconds,
            total_s=round(total_s, 4),
            budget_s=self._budget_s,
            slowest=max(seconds, key=lambda stage: seconds[stage]),
        )
