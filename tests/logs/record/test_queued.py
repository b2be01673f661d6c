"""Between the network and the disk: taking never waits, what does not fit is counted, order and times are kept."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from drivers.ros.messages import encode, make
from logs.mcap_io.reader import LogReader
from logs.record.queued import Cdr, QueuedRecorder
from logs.record.recorder import McapRecorder
from support.clocks import HandClock

STRING = "std_msgs/msg/String"


def word(text: str) -> Cdr:
    return Cdr("/words", STRING, 1, encode(make(STRING, data=text)))


def test_what_does_not_fit_is_dropped_and_counted_and_the_rest_is_written_in_order(tmp_path: Path) -> None:
    held, begun, clock = threading.Event(), threading.Event(), HandClock(step_ns=10**9)

    def held_back() -> Cdr:
        begun.set()
        held.wait(60)
        return word("0")

    with McapRecorder(tmp_path / "a.mcap", clock) as recorder:
        with QueuedRecorder(recorder, clock, max_bytes=250) as queue:
            queue.offer("/words", 100, held_back)
            assert begun.wait(60)
            for k in range(1, 6):  # the writer stands: two of them fit
                queue.offer("/words", 100, lambda k=k: word(str(k)))
            assert queue.backlog_bytes == 200
            held.set()
        stream = queue.streams["/words"]
    assert (stream.taken, stream.written, stream.dropped) == (6, 3, 3)
    assert "did not keep up" in stream.reason
    messages = list(LogReader(tmp_path / "a.mcap"))
    assert [m.payload for m in messages] == [word(str(k)).payload for k in range(3)]


def test_a_message_bears_the_time_at_which_it_was_taken(tmp_path: Path) -> None:
    held, clock, taken_ns = threading.Event(), HandClock(step_ns=10**9), []

    def make_word() -> Cdr:
        held.wait(60)
        return word("x")

    with McapRecorder(tmp_path / "a.mcap", clock) as recorder, QueuedRecorder(recorder, clock) as queue:
        for _ in range(3):
            taken_ns.append(clock.ns + 10**9)
            queue.offer("/words", 1, make_word)
        held.set()
    assert [m.log_time_ns for m in LogReader(tmp_path / "a.mcap")] == taken_ns


def test_what_cannot_be_converted_is_dropped_with_its_reason_and_the_recording_goes_on(tmp_path: Path) -> None:
    def refuse() -> Cdr:
        raise ValueError("no image")

    clock = HandClock(step_ns=10**9)
    with McapRecorder(tmp_path / "a.mcap", clock) as recorder, QueuedRecorder(recorder, clock) as queue:
        queue.offer("/words", 1, refuse)
        queue.offer("/words", 1, lambda: word("on"))
        queue.drain()
    assert (queue.streams["/words"].written, queue.streams["/words"].reason) == (1, "no image")


def test_a_fault_of_this_program_is_raised_and_not_swallowed(tmp_path: Path) -> None:
    clock = HandClock(step_ns=10**9)
    with McapRecorder(tmp_path / "a.mcap", clock) as recorder:
        queue = QueuedRecorder(recorder, clock)
        with pytest.raises(RuntimeError, match="modulo by zero"), queue:
            queue.offer("/words", 1, lambda: word(str(1 // 0)))
    assert queue.streams["/words"].dropped == 1


def test_what_the_disk_refuses_is_counted_as_dropped(tmp_path: Path) -> None:
    clock = HandClock(step_ns=10**9)
    with McapRecorder(tmp_path / "a.mcap", clock) as recorder, QueuedRecorder(recorder, clock) as queue:
        queue.offer("/words", 1, lambda: word("kept"))
        queue.drain()
        recorder.close()
        queue.offer("/words", 1, lambda: word("late"))
    assert (queue.streams["/words"].written, queue.streams["/words"].dropped) == (1, 1)
