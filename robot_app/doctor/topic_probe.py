"""What a few seconds of listening tell of a robot's topics: rates, gaps, the clocks, and how old transforms are."""

from __future__ import annotations

import itertools
import statistics
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field

from drivers.ports import Clock
from drivers.ros.convert import transforms_of
from drivers.ros.diagnosis import Diagnosis, diagnoses_of
from drivers.ros.messages import WireError, decode
from drivers.topics import DIAGNOSTICS, TF, TF_STATIC, Topic
from logs.record.tap import header_stamp
from robot_app.wiring import Wire

GAP = 1.5  # periods


@dataclass
class ProbedTopic:
    """One topic. stamps_ns: of the messages; lags_ns: their age when they came. unreadable: messages that are none."""

    stamps_ns: list[int] = field(default_factory=list)
    lags_ns: list[int] = field(default_factory=list)
    unreadable: int = 0

    @property
    def frozen(self) -> bool:
        """Messages come, but their stamps stand still."""
        return len(self.stamps_ns) > 2 and len(set(self.stamps_ns)) == 1

    @property
    def missing(self) -> int:
        """Messages that the gaps between the stamps leave room for."""
        stamps = sorted(set(self.stamps_ns))
        steps = [b - a for a, b in itertools.pairwise(stamps)]
        period = statistics.median(steps) if steps else 0
        return sum(round(step / period) - 1 for step in steps if step > GAP * period)


class TopicProbe:
    """`hear(wire, topics)` and `count(port, counter)` as often as needed, then `listen`.

    Callbacks come on Zenoh's threads.
    """

    def __init__(self, clock: Clock) -> None:
        self.topics: dict[str, ProbedTopic] = {}
        self.edges: dict[tuple[str, str], int | None] = {}  # (parent, child) -> newest stamp, None where static
        self.seconds = 0.0
        self.diagnoses: dict[str, tuple[Diagnosis, ...]] = {}  # sensor -> the newest
        self._counters: dict[str, Callable[[], int]] = {}
        self._counted: dict[str, int] = {}
        self._clock, self._lock = clock, threading.Lock()

    def hear(self, wire: Wire, topics: tuple[Topic, ...]) -> None:
        """Begin to listen to these."""
        for topic in topics:
            self.topics[topic.name] = ProbedTopic()
            wire.link.subscribe(wire.keys.topic(topic), self._keeper(topic), history=topic.latched)

    def count(self, port: str, counter: Callable[[], int]) -> None:
        """A sensor that is no topic: how many samples its driver has had so far."""
        self._counters[port] = counter

    def hear_diagnoses(self, wire: Wire) -> None:
        """What `openbelief onboard` says of its sensors, where one runs."""
        wire.link.subscribe(wire.keys.topic(DIAGNOSTICS), self._keep_diagnoses)

    def listen(self, seconds: float) -> None:
        """Let that much of the robot's time pass."""
        for heard in self.topics.values():
            heard.stamps_ns.clear()
            heard.lags_ns.clear()
        before = {port: counter() for port, counter in self._counters.items()}
        self._clock.sleep(seconds)
        self._counted = {port: counter() - before[port] for port, counter in self._counters.items()}
        self.seconds = seconds

    def rate_hz(self, topic: str) -> float:
        return len(self.topics[topic].stamps_ns) / self.seconds

    def counted_hz(self, port: str) -> float:
        """Of a sensor that is counted; 0 where its driver began to count anew meanwhile."""
        return max(self._counted[port], 0) / self.seconds

    def _keeper(self, topic: Topic) -> Callable[[bytes], None]:
        heard = self.topics[topic.name]

        def keep(payload: bytes) -> None:
            now_ns = self._clock.now_ns()
            with self._lock:
                try:
                    stamp_ns = header_stamp(topic, payload)
                    if topic.name in (TF.name, TF_STATIC.name):
                        self._keep_edges(payload, topic)
                except WireError:
                    heard.unreadable += 1
                    return
                heard.stamps_ns.append(stamp_ns)
                heard.lags_ns.append(now_ns - stamp_ns)

        return keep

    def _keep_diagnoses(self, payload: bytes) -> None:
        """Each message is of one sensor, the first word of its findings' names."""
        found: tuple[Diagnosis, ...] = ()
        if len(payload) <= DIAGNOSTICS.max_bytes:
            with suppress(WireError):  # another's
                found = diagnoses_of(decode(payload, DIAGNOSTICS.type_name))
        if found:
            self.diagnoses[found[0].name.split()[0]] = found

    def _keep_edges(self, payload: bytes, topic: Topic) -> None:
        for t in transforms_of(decode(payload, topic.type_name)):
            self.edges[t.parent, t.child] = None if topic.name == TF_STATIC.name else t.stamp_ns
