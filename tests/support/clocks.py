"""A clock that the test moves, for code that runs on no simulation."""

from __future__ import annotations

from collections.abc import Callable


class HandClock:
    """The Clock port: time passes by `ns`, by sleeping, and by `step_ns` at every look.

    sleeps: seconds of every sleep. on_sleep: called after each.
    """

    def __init__(self, ns: int = 0, *, step_ns: int = 0) -> None:
        self.ns, self._step_ns = ns, step_ns
        self.sleeps: list[float] = []
        self.on_sleep: Callable[[], None] = lambda: None

    def now_ns(self) -> int:
        self.ns += self._step_ns
        return self.ns

    def sleep(self, seconds: float) -> None:
        self.ns += round(seconds * 1e9)
        self.sleeps.append(seconds)
        self.on_sleep()
