"""Where a recording's clock was set back (NTP step, simulator reset, a bag played twice), unlike messages out of order.

Every publisher stamps its messages one after the other. Where the stamps of one stream fall and then climb again
through a time that it had been through, its clock was set back; where only a few come late, the network was slow. A
whole file out of order (a writer of many threads) is brought back into the order of logging first.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from drivers.stamps import SET_BACK_NS

Stream = Hashable
FEW = 4  # messages: a stream of less says nothing of order
INTERLEAVED = 3  # changes between before and after, in the order of stamps: 1 or 2 are late messages


@dataclass(frozen=True, slots=True)
class Mark:
    """Where and when one message stands. order: its place among all messages of the recording."""

    order: int
    log_time_ns: int
    stamp_ns: int


@dataclass(frozen=True)
class ClockStep:
    """place: of the first message after it. before_ns, after_ns: the stamps around it where one stream shows it first.

    places, stamps: that stream's messages since. is_logged_so: the time of logging went back as well.
    """

    place: int
    before_ns: int
    after_ns: int
    is_logged_so: bool
    places: tuple[int, ...] = field(repr=False)
    stamps: tuple[int, ...] = field(repr=False)

    @property
    def back_s(self) -> float:
        return (self.before_ns - self.after_ns) / 1e9

    def is_before(self, place: int, stamp_ns: int) -> bool:
        """Whether a message was stamped before the step: it stands before it, or its stamp is ahead of the new time."""
        now_ns = self.stamps[max(bisect_right(self.places, place) - 1, 0)]
        return place < self.place or stamp_ns > now_ns + (self.before_ns - self.after_ns) // 2


class Epochs:
    """The parts of a recording between the steps of its clock, numbered from 0; within one, stamps can be compared."""

    def __init__(self, streams: Mapping[Stream, Sequence[Mark]]) -> None:
        self._place = _order_of(streams)
        falls = self._find(streams)
        if self._place is _by_order and any(self._is_misplaced(step) for step in self.steps):
            self._place = _by_log_time
            falls = self._find(streams)
        self._own = {stream: {self._streams[stream][at].order for at, _ in found} for stream, found in falls.items()}

    def _find(self, streams: Mapping[Stream, Sequence[Mark]]) -> dict[Stream, list[tuple[int, int]]]:
        """Sets the streams in order and the steps in them; returns where each stream's stamps fall."""
        self._streams = {stream: sorted(marks, key=self._place) for stream, marks in streams.items()}
        falls = {stream: _falls(marks) for stream, marks in self._streams.items()}
        self.steps = _steps(self._streams, falls, self._place)
        return falls

    def _is_misplaced(self, step: ClockStep) -> bool:
        """Whether what looks like a step is a part of the file that lies behind its time: its time of logging falls as
        its stamps do, and most of what was sent before it is not sent any more. A clock that is set ends nothing."""
        before = [marks for marks in self._streams.values() if marks and self._place(marks[0]) < step.place]
        go_on = sum(self._place(marks[-1]) >= step.place for marks in before)
        return step.is_logged_so and 2 * go_on <= len(before)

    def place(self, mark: Mark) -> int:
        """What orders messages in time: their place in the file, or the time of logging."""
        return self._place(mark)

    def of_stream(self, stream: Stream) -> dict[int, int]:
        """The epoch of each of its messages, by their `order`."""
        epoch, found = 0, {}
        for mark in self._streams[stream]:
            place = self._place(mark)
            while epoch < len(self.steps) and self.steps[epoch].place <= place:
                if mark.order not in self._own[stream] and self.steps[epoch].is_before(place, mark.stamp_ns):
                    break
                epoch += 1
            found[mark.order] = epoch
        return found

    def of_mark(self, mark: Mark) -> int:
        """The epoch of a message of another stream."""
        place = self._place(mark)
        return next((i for i, step in enumerate(self.steps) if step.is_before(place, mark.stamp_ns)), len(self.steps))


def _order_of(streams: Mapping[Stream, Sequence[Mark]]) -> Callable[[Mark], int]:
    """By place in the file; by the time of logging where most streams are shuffled."""
    long = [sorted(marks, key=_by_order) for marks in streams.values() if len(marks) >= FEW]
    return _by_log_time if 2 * sum(map(_is_shuffled, long)) > len(long) else _by_order


def _by_order(mark: Mark) -> int:
    return mark.order


def _by_log_time(mark: Mark) -> int:
    return mark.log_time_ns


def _is_shuffled(marks: Sequence[Mark]) -> bool:
    """Runs of rising stamps are shorter than FEW on average."""
    falls = sum(b.stamp_ns < a.stamp_ns for a, b in pairwise(marks))
    return falls > 0 and len(marks) < FEW * (falls + 1)


def _falls(marks: Sequence[Mark]) -> list[tuple[int, int]]:
    """(index of the first message after each step of this stream's clock, its newest stamp before it)."""
    if _is_shuffled(marks):
        return []  # two publishers of different clocks on one topic: no order to be told
    found, start, newest = [], 0, -(1 << 63)
    for at, mark in enumerate(marks):
        if mark.stamp_ns < newest and _is_step(marks, start, at, newest):
            found.append((at, newest))
            start, newest = at, mark.stamp_ns
        newest = max(newest, mark.stamp_ns)
    return found


def _is_step(marks: Sequence[Mark], start: int, at: int, newest: int) -> bool:
    """Whether what follows goes again through the time before, rather than fills a hole in it."""
    again: list[int] = []
    for mark in marks[at:]:
        if mark.stamp_ns > newest or (again and mark.stamp_ns < again[-1]):
            break
        again.append(mark.stamp_ns)
    if marks[at].stamp_ns < newest - SET_BACK_NS:
        return len(again) > 1 or at == len(marks) - 1
    first = [m.stamp_ns for m in marks[start:at] if m.stamp_ns >= again[0]]
    labels = [after for _, after in sorted([(s, 0) for s in first] + [(s, 1) for s in again])]
    return sum(a != b for a, b in pairwise(labels)) >= INTERLEAVED


def _steps(
    streams: Mapping[Stream, Sequence[Mark]],
    falls: Mapping[Stream, Sequence[tuple[int, int]]],
    place: Callable[[Mark], int],
) -> list[ClockStep]:
    """The falls of single streams, joined into steps of the recording's clock: each stream shows one at most once."""
    seen = sorted(
        ((place(streams[stream][at]), stream, at, newest) for stream, found in falls.items() for at, newest in found),
        key=lambda fall: fall[0],
    )
    steps: list[ClockStep] = []
    witnesses: set[Stream] = set()
    for where, stream, at, newest in seen:
        if steps and stream not in witnesses:
            witnesses.add(stream)
            continue
        witnesses = {stream}
        end = next((i for i, _ in falls[stream] if i > at), None)
        after = streams[stream][at:end]
        logged_back_ns = streams[stream][at - 1].log_time_ns - after[0].log_time_ns
        steps.append(
            ClockStep(
                where,
                newest,
                after[0].stamp_ns,
                2 * logged_back_ns > newest - after[0].stamp_ns,
                tuple(map(place, after)),
                tuple(m.stamp_ns for m in after),
            )
        )
    return steps
