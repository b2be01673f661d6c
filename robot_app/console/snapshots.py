"""The live page's picture of the robot: numbered snapshots of operator, mission and telemetry.

A command and a sign of life name the snapshot that was on the screen. How old that snapshot is, by our own clock, says
whether they still count: a page that hangs, a tab behind, and bytes that waited in a socket all name an old one.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from logs.trial.journal import Attached
from logs.trial.records import Query, Record
from openbelief.memory import ObjectMemory
from robot_app.console.telemetry import Readings
from robot_app.mission.notices import Change, Notice
from robot_app.mission.operator import SharedOperator
from robot_app.mission.view import MissionView

KEPT = 600  # snapshots whose time is known: a minute at 10 Hz
SAID_KEPT = 40


class LiveMission:
    """A Journal that folds what it sees into the MissionView of the mission under way, or the last one. Thread-safe."""

    def __init__(self, memory: ObjectMemory) -> None:
        self._memory, self._lock = memory, threading.Lock()
        self._view: MissionView | None = None
        self._before: MissionView | None = None  # whose pictures a page may still be asking for
        self._json: dict[str, Any] | None = None
        self.version = 0

    def write(self, record: Record, attached: Attached = None) -> None:
        with self._lock:
            if isinstance(record, Query):
                self._before, self._view = self._view, MissionView(self._memory)
            if self._view is not None:
                self._view.see(record, attached)
                self.version += 1
                self._json = None

    @property
    def moving(self) -> bool:
        view = self._view
        return view is not None and view.moving

    def as_json(self) -> dict[str, Any] | None:
        with self._lock:
            if self._json is None and self._view is not None:
                self._json = self._view.as_json()
            return self._json

    def frame_jpeg(self, stamp_ns: int) -> bytes | None:
        """The picture that a look was judged by."""
        from robot_app.console.site_plan import jpeg

        with self._lock:
            looks = [look for view in (self._view, self._before) if view is not None for look in view.looks]
            frame = next((look.frame for look in looks if look.frame.stamp_ns == stamp_ns), None)
        return None if frame is None else jpeg(frame.color)


class Snapshots:
    """Makes them, and remembers when each was made."""

    def __init__(
        self,
        operator: SharedOperator,
        live: LiveMission,
        readings: Callable[[], Readings],
        now_s: Callable[[], float] = time.monotonic,
        extra: Callable[[], dict[str, Any]] = dict,
    ) -> None:
        self._operator, self._live, self._readings, self._now_s, self._extra = operator, live, readings, now_s, extra
        self._lock = threading.Lock()
        self._made: OrderedDict[int, float] = OrderedDict()
        self._number = 0
        self._said: list[dict[str, Any]] = []
        operator.listen(self._hear)

    def age_s(self, number: int) -> float | None:
        """How long ago that snapshot was made; None where it never was, or too long ago."""
        with self._lock:
            made_s = self._made.get(number)
        return None if made_s is None else self._now_s() - made_s

    def make(self) -> dict[str, Any]:
        """The next one, without what only its reader knows."""
        with self._lock:
            self._number += 1
            number = self._number
            self._made[number] = self._now_s()
            while len(self._made) > KEPT:
                self._made.popitem(last=False)
            said = list(self._said)
        return {
            "type": "state",
            "n": number,
            "robot": self._readings().as_json(),
            "operator": operator_json(self._operator),
            "mission": self._live.as_json(),
            "said": said,
            **self._extra(),
        }

    def _hear(self, notice: Notice) -> None:
        if not notice.sentence or notice.change is Change.ASKED:
            return
        with self._lock:
            self._said.append({"at_ms": time.time_ns() // 1_000_000, "kind": notice.change, "text": notice.sentence})
            del self._said[:-SAID_KEPT]


def operator_json(operator: SharedOperator) -> dict[str, Any]:
    """Of one moment: no question without its mission, no queue of who does not command any more."""
    return operator.at_once(lambda: _operator_json(operator))


def _operator_json(operator: SharedOperator) -> dict[str, Any]:
    lease, asked, stop, mission = operator.lease, operator.question, operator.stop_requested(), operator.mission
    return {
        "lease": None if lease is None else {"who": lease.who, "how": lease.how, "epoch": lease.epoch},
        "question": None if asked is None else question_json(operator),
        "stop": None if stop is None else {"because": stop.because, "who": stop.who, "how": stop.how},
        "mission": None if mission is None else {"sentence": mission.text, "who": mission.who, "how": mission.how},
        "waiting": [{"sentence": each.text, "who": each.who} for each in operator.waiting],
        "silence": operator.silence(),
    }


def question_json(operator: SharedOperator) -> dict[str, Any] | None:
    asked = operator.question
    if asked is None:
        return None
    question = asked.question
    goal = question.goal
    return {
        "id": asked.id,
        "sentence": question.sentence,
        "because": question.because,
        "doubt": question.doubt,
        "object_id": question.object_id,
        "memory_hash": question.memory_hash,
        "goal": None if goal is None else {"x": goal.x, "y": goal.y, "yaw": goal.yaw},
        "path_length_m": question.path_length_m,
        "options": [{"number": o.number, "object_id": o.object_id} for o in question.options],
        "timeout_s": asked.timeout_s,
        "left_s": round(operator.left_s(), 2),
    }
