"""The watchdog's logic on a moved clock: rows of (time, facts) and what must happen then."""

from __future__ import annotations

import pytest

from drivers.watchdog.latch import RETRY_S, SILENCE_S, Watchdog, WatchdogAction, WatchdogFacts, WatchdogState

S = 1_000_000_000
W = "workstation"


def at(seconds: float) -> int:
    return round(seconds * S)


def trip(watchdog: Watchdog, seconds: float = 1.0) -> None:
    """Armed by one beat, tripped by its silence."""
    watchdog.update(at(seconds), WatchdogFacts({W: at(seconds)}))
    assert watchdog.update(at(seconds + SILENCE_S + 0.01), WatchdogFacts({W: at(seconds)})) is WatchdogAction.CANCEL


# name -> (seconds now, facts, action, state): each from a watchdog that heard a beat at 1.0 s
ROWS = {
    "a beat in time": (1.5, WatchdogFacts({W: at(1.4)}), WatchdogAction.NONE, WatchdogState.ARMED),
    "just not silent": (1.0 + SILENCE_S, WatchdogFacts({W: at(1.0)}), WatchdogAction.NONE, WatchdogState.ARMED),
    "silent": (1.0 + SILENCE_S + 0.001, WatchdogFacts({W: at(1.0)}), WatchdogAction.CANCEL, WatchdogState.LATCHED),
    "token gone": (1.05, WatchdogFacts({W: at(1.0)}, {W: at(1.04)}), WatchdogAction.CANCEL, WatchdogState.LATCHED),
    "token gone, then a beat": (
        1.2,
        WatchdogFacts({W: at(1.1)}, {W: at(1.04)}),
        WatchdogAction.NONE,
        WatchdogState.ARMED,
    ),
    "goodbye": (1.2, WatchdogFacts({W: at(1.1)}, left=frozenset({W})), WatchdogAction.NONE, WatchdogState.WAITING),
    "token gone after goodbye": (
        1.3,
        WatchdogFacts({W: at(1.1)}, {W: at(1.2)}, frozenset({W})),
        WatchdogAction.NONE,
        WatchdogState.WAITING,
    ),
    "long after goodbye": (
        99.0,
        WatchdogFacts({W: at(1.1)}, left=frozenset({W})),
        WatchdogAction.NONE,
        WatchdogState.WAITING,
    ),
    "another one beats, the first is silent": (
        2.0,
        WatchdogFacts({W: at(1.0), "other": at(1.95)}),
        WatchdogAction.CANCEL,
        WatchdogState.LATCHED,
    ),
    "one left, another is silent": (
        2.0,
        WatchdogFacts({W: at(1.0), "other": at(1.95)}, left=frozenset({"other"})),
        WatchdogAction.CANCEL,
        WatchdogState.LATCHED,
    ),
}


@pytest.mark.parametrize("name", ROWS)
def test_each_fact_has_its_action(name):
    seconds, facts, action, state = ROWS[name]
    watchdog = Watchdog()
    watchdog.update(at(1.0), WatchdogFacts({W: at(1.0)}))
    assert (watchdog.update(at(seconds), facts), watchdog.state) == (action, state)
    assert bool(watchdog.reason) == (state is WatchdogState.LATCHED)


def test_nothing_is_cancelled_before_a_workstation_was_heard():
    watchdog = Watchdog()
    for seconds in (0.0, 1.0, 1000.0):
        assert watchdog.update(at(seconds), WatchdogFacts({}, driving=True)) is WatchdogAction.NONE
    assert watchdog.state is WatchdogState.WAITING


def test_the_cancel_is_repeated_until_nav2_acknowledges_it():
    watchdog = Watchdog()
    trip(watchdog, 1.0)
    end = 1.0 + SILENCE_S + 0.01
    beats = {W: at(1.0)}
    actions = [watchdog.update(at(end + i * 0.05), WatchdogFacts(beats)) for i in range(1, 21)]
    assert actions.count(WatchdogAction.CANCEL) == round(1.0 / RETRY_S)
    assert watchdog.update(at(end + 2.0), WatchdogFacts(beats, acknowledged=True)) is WatchdogAction.NONE


def test_a_goal_that_runs_though_latched_is_cancelled_again():
    watchdog = Watchdog()
    trip(watchdog)
    facts = WatchdogFacts({W: at(1.0)}, acknowledged=True)
    assert watchdog.update(at(5.0), facts) is WatchdogAction.NONE
    driving = WatchdogFacts({W: at(1.0)}, acknowledged=True, driving=True)
    assert watchdog.update(at(6.0), driving) is WatchdogAction.CANCEL


def test_a_workstation_that_comes_back_does_not_undo_the_latch():
    watchdog = Watchdog()
    trip(watchdog)
    for seconds in (3.0, 3.1, 60.0):
        watchdog.update(at(seconds), WatchdogFacts({W: at(seconds)}, acknowledged=True))
        assert watchdog.latched


def test_only_a_person_resets_it_and_only_once_nav2_has_stopped():
    watchdog = Watchdog()
    trip(watchdog)
    watchdog.update(at(3.0), WatchdogFacts({W: at(1.0)}, reset=True))
    assert watchdog.latched
    watchdog.update(at(4.0), WatchdogFacts({W: at(1.0)}, acknowledged=True, reset=True))
    assert watchdog.state is WatchdogState.WAITING and watchdog.reason == ""


def test_after_a_reset_the_silent_workstation_does_not_trip_it_again_and_a_new_beat_arms_it():
    watchdog = Watchdog()
    trip(watchdog)
    watchdog.update(at(4.0), WatchdogFacts({W: at(1.0)}, acknowledged=True, reset=True))
    assert watchdog.update(at(5.0), WatchdogFacts({W: at(1.0)})) is WatchdogAction.NONE
    watchdog.update(at(6.0), WatchdogFacts({W: at(6.0)}))
    assert watchdog.state is WatchdogState.ARMED
    assert watchdog.update(at(6.8), WatchdogFacts({W: at(6.0)})) is WatchdogAction.CANCEL
