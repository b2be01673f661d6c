from __future__ import annotations

import threading

import pytest

from robot_app.mapping.stopwatch import Stopwatch
from robot_app.mapping.watch import Steps
from robot_app.progress_lines import LineProgress, stage_rates


@pytest.fixture
def time_s(monkeypatch) -> list[float]:
    """The performance counter, as a list of one number."""
    now = [0.0]
    monkeypatch.setattr("robot_app.mapping.stopwatch.time.perf_counter", lambda: now[0])
    return now


def work(clock: Stopwatch, stage: str, seconds: float, time_s: list[float]) -> None:
    with clock(stage):
        time_s[0] += seconds


def test_a_stage_with_more_workers_is_that_much_faster(time_s):
    clock = Stopwatch()
    clock.watch({"phrases": 4, "segments": 1})
    for _ in range(3):
        work(clock, "phrases", 2.0, time_s)
        work(clock, "segments", 0.1, time_s)
    assert clock.rates() == pytest.approx({"phrases": 2.0, "segments": 10.0})


def test_only_watched_stages_have_a_rate_and_only_since_they_are_watched(time_s):
    clock = Stopwatch()
    work(clock, "read", 100.0, time_s)
    work(clock, "build", 1.0, time_s)
    clock.watch({"read": 1, "acquire": 1})
    assert clock.rates() == {}
    work(clock, "read", 0.5, time_s)
    assert clock.rates() == pytest.approx({"read": 2.0})
    assert clock.seconds["read"] == 100.5


def test_a_stage_that_fails_is_timed_too(time_s):
    clock = Stopwatch()
    with pytest.raises(OSError, match="gone"), clock("read"):
        time_s[0] += 3
        raise OSError("gone")
    assert clock.seconds == {"read": 3.0}


def test_stages_side_by_side_are_each_timed_whole():
    clock, meeting = Stopwatch(), threading.Barrier(4)
    clock.watch({"phrases": 4})

    def look() -> None:
        with clock("phrases"):
            meeting.wait(20)

    threads = [threading.Thread(target=look) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert clock.rates() == pytest.approx({"phrases": 4 * 4 / clock.seconds["phrases"]})


def test_the_slowest_stage_is_named_first(capsys):
    assert stage_rates({"read": 20.0, "phrases": 1.25, "segments": 8.0}) == "phrases 1.2/s, segments 8.0/s, read 20.0/s"
    LineProgress().frames("walk.mcap", 1, 5, {"read": 20.0, "phrases": 1.25})
    assert "walk.mcap: 1 of 5 frames (phrases 1.2/s, read 20.0/s)" in capsys.readouterr().err


def test_steps_end_where_the_next_begins_and_what_is_between_them_is_not_counted(time_s):
    clock = Stopwatch()
    steps = Steps(clock)
    for step in ("perceive", "acquire", None, "perceive"):
        steps.begin(step)
        time_s[0] += 2.0
    steps.begin(None)
    assert clock.seconds == {"perceive": 4.0, "acquire": 2.0}
