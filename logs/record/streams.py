"""What became of one topic's messages: written, dropped by us, lost before that, and the holes in their stamps."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

REMEMBERED = 32  # steps between stamps
JUDGED_FROM = 8  # steps; before that nobody knows what is usual
HOLE = 1.7  # times the usual step: at a steady rate one message is missing


class StampIntervals:
    """The steps between a topic's stamps, in the order of coming. A hole is a step far longer than nine in ten are.

    backwards: stamps that were not after the one before.
    """

    def __init__(self) -> None:
        self.holes = self.backwards = 0
        self.longest_hole_s = self.longest_step_s = 0.0
        self._last_ns: int | None = None
        self._steps_ns: deque[int] = deque(maxlen=REMEMBERED)
        self._usual_ns: int | None = None
        self._seen = 0

    def see(self, stamp_ns: int) -> None:
        last_ns, self._last_ns = self._last_ns, stamp_ns
        if last_ns is None:
            return
        if stamp_ns <= last_ns:
            self.backwards += 1
            return
        self._step(stamp_ns - last_ns)

    def _step(self, step_ns: int) -> None:
        self.longest_step_s = max(self.longest_step_s, step_ns / 1e9)
        if self._usual_ns is not None and step_ns > HOLE * self._usual_ns:
            self.holes += 1
            self.longest_hole_s = max(self.longest_hole_s, step_ns / 1e9)
        self._steps_ns.append(step_ns)
        self._seen += 1
        if self._seen % JUDGED_FROM == 0:
            self._usual_ns = sorted(self._steps_ns)[len(self._steps_ns) * 9 // 10]


@dataclass
class RecordedStream:
    """dropped: by the recorder; reason: of its newest drop. lost: before that, by where. taken_ns: the newest's time.

    lasting: it should go on coming until the end, so that silence is worth a word.
    """

    taken: int = 0
    written: int = 0
    dropped: int = 0
    bytes: int = 0
    reason: str = ""
    lost: dict[str, int] = field(default_factory=dict)
    taken_ns: int | None = None
    lasting: bool = False
    pace: StampIntervals = field(default_factory=StampIntervals)

    def drop(self, reason: str) -> None:
        self.dropped, self.reason = self.dropped + 1, reason
