"""When a clock was set back, what came before and after is told apart; late messages and shuffled files are neither."""

from __future__ import annotations

import numpy as np
import pytest

from logs.frames.clock_steps import Epochs, Mark

MS = 1_000_000


def recorded(*streams: tuple[str, int, int], steps: dict[int, int] | None = None, until_ms: int = 10_000):
    """Streams (name, period, delay of arrival), in ms, on a clock that is set by `steps` (true time -> change), ms.

    Everything is logged by a clock that is never set, in the order of arrival.
    """
    events = []
    for name, period, delay in streams:
        for true in range(0, until_ms, period):
            clock = true + sum(change for at, change in (steps or {}).items() if true >= at)
            events.append((true + delay, name, clock))
    events.sort()
    marks: dict[str, list[Mark]] = {}
    for order, (arrival, name, clock) in enumerate(events):
        marks.setdefault(name, []).append(Mark(order, arrival * MS, clock * MS))
    return marks


def truth(name: str, period: int, steps: dict[int, int], until_ms: int = 10_000) -> list[int]:
    return [sum(true >= at for at in steps) for true in range(0, until_ms, period)]


@pytest.mark.parametrize("back", [30, 80, 150, 400, 999, 1000, 1700, 4000, 1_000_000])
def test_a_step_of_any_size_parts_every_stream_where_it_happened(back):
    """A camera, whose images arrive late, between fast transforms."""
    streams = ("tf", 10, 0), ("tf2", 20, 2), ("camera", 100, 60)
    steps = {5000: -back}
    epochs = Epochs(recorded(*streams, steps=steps))
    assert len(epochs.steps) == 1
    for name, period, _ in streams:
        assert list(epochs.of_stream(name).values()) == truth(name, period, steps), name


def test_several_steps_are_each_told():
    steps = {2000: -1500, 5000: -3000, 7000: +10_000, 9000: -2500}
    epochs = Epochs(recorded(("tf", 20, 0), ("camera", 100, 40), steps=steps))
    backwards = {at: change for at, change in steps.items() if change < 0}
    assert [step.back_s for step in epochs.steps] == pytest.approx([1.48, 2.98, 2.48])
    assert list(epochs.of_stream("camera").values()) == truth("camera", 100, backwards)


def test_a_bag_played_twice_is_two_parts():
    once = recorded(("tf", 50, 0), ("camera", 200, 10), until_ms=3000)
    count = sum(map(len, once.values()))
    twice = {
        n: [*m, *(Mark(x.order + count, x.log_time_ns + 4000 * MS, x.stamp_ns) for x in m)] for n, m in once.items()
    }
    epochs = Epochs(twice)
    assert [step.back_s for step in epochs.steps] == pytest.approx([2.95])
    assert sum(epochs.of_stream("camera").values()) == len(once["camera"])


def test_a_stream_too_slow_to_show_the_step_follows_the_others():
    """A localiser once in three seconds on a clock set back by 0.4 s: its own stamps never fall."""
    steps = {5000: -400}
    epochs = Epochs(recorded(("tf", 20, 0), ("localiser", 3000, 30), steps=steps))
    assert list(epochs.of_stream("localiser").values()) == truth("localiser", 3000, steps)


def test_stamps_in_the_future_do_not_hide_the_step():
    """AMCL stamps map -> odom a second ahead."""
    marks = recorded(("tf", 20, 0), ("amcl", 100, 5), steps={5000: -2000})
    marks["amcl"] = [Mark(m.order, m.log_time_ns, m.stamp_ns + 1000 * MS) for m in marks["amcl"]]
    epochs = Epochs(marks)
    assert list(epochs.of_stream("amcl").values()) == truth("amcl", 100, {5000: -2000})


def test_messages_that_come_late_are_no_step():
    marks = recorded(("tf", 50, 0), ("camera", 100, 30))
    order = [m.order for m in marks["camera"]]
    late = [7, 30, 31, 32, 60]  # single ones and a burst
    moved = {i: order[i] + 40 for i in late}
    marks["camera"] = [
        Mark(moved.get(i, m.order) * 10 + i % 10, m.log_time_ns, m.stamp_ns) for i, m in enumerate(marks["camera"])
    ]
    marks["tf"] = [Mark(m.order * 10, m.log_time_ns, m.stamp_ns) for m in marks["tf"]]
    assert Epochs(marks).steps == []


@pytest.mark.parametrize("seed", range(3))
def test_a_shuffled_file_is_put_in_order_by_the_time_of_logging(seed):
    marks = recorded(("tf", 50, 0), ("camera", 100, 30), until_ms=5000)
    count = sum(map(len, marks.values()))
    place = np.random.default_rng(seed).permutation(count).tolist()
    shuffled = {n: [Mark(place[m.order], m.log_time_ns, m.stamp_ns) for m in stream] for n, stream in marks.items()}
    assert Epochs(shuffled).steps == []


def test_a_shuffled_file_of_a_simulator_that_was_reset_still_has_its_step():
    steps = {5000: -2000}
    marks = recorded(("tf", 50, 0), ("camera", 100, 30), steps=steps)
    place = np.random.default_rng(1).permutation(sum(map(len, marks.values()))).tolist()
    epochs = Epochs({n: [Mark(place[m.order], m.log_time_ns, m.stamp_ns) for m in s] for n, s in marks.items()})
    found = epochs.of_stream("camera")
    assert [found[place[m.order]] for m in marks["camera"]] == truth("camera", 100, steps)


def test_two_clocks_on_one_topic_are_no_step():
    marks = recorded(("tf", 50, 0), ("camera", 100, 30))
    marks["tf"] = [Mark(m.order, m.log_time_ns, m.stamp_ns - (i % 2) * 2000 * MS) for i, m in enumerate(marks["tf"])]
    assert Epochs(marks).steps == []


def test_a_message_of_no_stream_is_numbered_by_its_stamp():
    steps = {5000: -2000}
    marks = recorded(("tf", 20, 0), ("cloud", 100, 50), steps=steps)
    clouds = marks.pop("cloud")
    epochs = Epochs(marks)
    assert [epochs.of_mark(m) for m in clouds] == truth("cloud", 100, steps)


@pytest.mark.parametrize("back", [80, 400, 2000])
def test_a_recorder_whose_own_clock_was_set_back_logs_so_and_it_is_still_a_step(back):
    steps = {5000: -back}
    marks = recorded(("tf", 10, 0), ("tf2", 10, 0), ("camera", 100, 60), steps=steps)
    logged = {n: [Mark(m.order, m.stamp_ns + MS, m.stamp_ns) for m in stream] for n, stream in marks.items()}
    logged["camera"] = [m for m in logged["camera"] if m.order > 2 * 5000 // 10 + 100]  # images only long after it
    epochs = Epochs(logged)
    assert len(epochs.steps) == 1 and set(epochs.of_stream("camera").values()) == {1}
    assert list(epochs.of_stream("tf").values()) == truth("tf", 10, steps)


def test_a_part_of_the_file_that_lies_behind_its_time_is_no_step():
    """A second publisher's transforms, appended to the file by a tool that merges without sorting."""
    marks = recorded(("tf", 50, 0), ("other", 50, 0), ("camera", 100, 30), until_ms=3000)
    last = 10 * max(m.order for stream in marks.values() for m in stream)
    appended = [Mark(last + i, m.log_time_ns, m.stamp_ns + 25 * MS) for i, m in enumerate(marks["tf"])]
    marks["tf"] = marks["tf"] + appended
    epochs = Epochs(marks)
    assert epochs.steps == [] and set(epochs.of_stream("tf").values()) == {0}
