from __future__ import annotations

import threading

import pytest

from drivers.clock import SimClock
from drivers.ports import Clock


def test_time_passes_only_while_somebody_sleeps():
    clock = SimClock(1_000)
    assert isinstance(clock, Clock)
    assert clock.now_ns() == 1_000
    clock.sleep(2.5)
    assert clock.now_ns() == 1_000 + 2_500_000_000
    clock.sleep(-1.0)
    assert clock.now_ns() == 1_000 + 2_500_000_000


def test_callbacks_run_in_order_of_due_time_and_see_it_as_now():
    clock, calls = SimClock(0), []
    clock.every(0.3, lambda: calls.append(("slow", clock.now_ns())))
    clock.every(0.2, lambda: calls.append(("fast", clock.now_ns())))
    clock.sleep(0.65)
    ms = 1_000_000
    assert calls == [
        ("fast", 200 * ms), ("slow", 300 * ms), ("fast", 400 * ms), ("slow", 600 * ms), ("fast", 600 * ms),
    ]  # fmt: skip


def test_many_short_sleeps_run_the_same_callbacks_as_a_long_one():
    runs = []
    for naps in ([1.0], [0.1] * 10, [0.33, 0.33, 0.34]):
        clock, calls = SimClock(0), []
        clock.every(0.07, lambda calls=calls, clock=clock: calls.append(clock.now_ns()))
        for nap in naps:
            clock.sleep(nap)
        runs.append(calls)
    assert runs[0] == runs[1] == runs[2]
    assert len(runs[0]) == 14


def test_a_stopped_callback_stays_silent_even_when_stopped_by_another():
    clock, calls = SimClock(0), []
    stop = clock.every(0.2, lambda: calls.append("late"))
    clock.every(0.1, lambda: stop())
    clock.sleep(1.0)
    assert calls == []


def test_what_a_callback_raises_comes_out_of_sleep_and_the_clock_goes_on():
    clock, calls = SimClock(0), []

    def fail_once() -> None:
        calls.append(clock.now_ns())
        if len(calls) == 1:
            raise OSError("the sensor broke")

    clock.every(0.1, fail_once)
    with pytest.raises(OSError, match="the sensor broke"):
        clock.sleep(0.35)
    clock.sleep(0.2)
    assert len(calls) == 3


def test_a_callback_must_not_sleep():
    clock = SimClock(0)
    clock.every(0.1, lambda: clock.sleep(1.0))
    with pytest.raises(RuntimeError, match="must not sleep"):
        clock.sleep(0.2)


def test_a_period_of_nothing_is_refused():
    with pytest.raises(ValueError, match="greater than 0"):
        SimClock(0).every(0.0, lambda: None)


def test_sleepers_of_several_threads_take_turns():
    clock, calls = SimClock(0), []
    clock.every(0.01, lambda: calls.append(clock.now_ns()))
    threads = [threading.Thread(target=clock.sleep, args=(1.0,)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=10)
    assert clock.now_ns() == 4_000_000_000
    assert len(calls) == 400
    assert calls == sorted(calls)
