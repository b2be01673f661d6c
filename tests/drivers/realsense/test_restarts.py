"""Stop, wait, restart, give up: the schedule on a clock moved by hand."""

from __future__ import annotations

import pytest

from drivers.realsense.restarts import ProcessPhase, RestartAction, RestartLimits, RestartPolicy

SECOND = 1_000_000_000
LIMITS = RestartLimits()


class Hand:
    """A watchdog and the time."""

    def __init__(self) -> None:
        self.watchdog, self.now_ns = RestartPolicy(LIMITS), 0

    def streaming(self) -> Hand:
        assert self.watchdog.due(self.now_ns) is RestartAction.START
        self.watchdog.started(self.now_ns)
        self.watchdog.opened(self.now_ns)
        self.watchdog.image(self.now_ns)
        return self

    def until(self, action: RestartAction, *, beats: bool = True, frozen: int = 0, within_s: float = 60.0) -> float:
        """Seconds until that is due."""
        start_ns = self.now_ns
        while self.watchdog.due(self.now_ns) is not action:
            self.now_ns += SECOND // 100
            if beats:
                self.watchdog.alive(self.now_ns, frozen)
            assert self.now_ns - start_ns < within_s * SECOND, f"{action} never came"
        return (self.now_ns - start_ns) / SECOND


@pytest.fixture
def hand() -> Hand:
    return Hand()


def test_four_missed_images_stop_the_process(hand) -> None:
    assert hand.streaming().until(RestartAction.STOP) == pytest.approx(4 * 0.25, abs=0.02)
    assert "no new image came for 1 s" in hand.watchdog.reason


def test_three_missed_images_do_not(hand) -> None:
    hand.streaming()
    for _ in range(20):
        hand.now_ns += round(3 * 0.25 * SECOND)
        assert hand.watchdog.due(hand.now_ns) is RestartAction.NOTHING
        hand.watchdog.image(hand.now_ns)


def test_a_process_without_a_sign_of_life_is_stopped_as_hanging(hand) -> None:
    assert hand.streaming().until(RestartAction.STOP, beats=False) == pytest.approx(LIMITS.hang_s, abs=0.02)
    assert "librealsense hangs" in hand.watchdog.reason


def test_frozen_images_are_named(hand) -> None:
    hand.streaming().until(RestartAction.STOP, frozen=30)
    assert "frozen" in hand.watchdog.reason


def test_a_first_image_may_take_longer(hand) -> None:
    hand.watchdog.started(0)
    hand.watchdog.opened(0)
    assert hand.until(RestartAction.STOP) == pytest.approx(LIMITS.first_image_s, abs=0.02)


def test_a_camera_that_does_not_open_is_stopped(hand) -> None:
    hand.watchdog.started(0)
    assert hand.until(RestartAction.STOP) == pytest.approx(LIMITS.open_s, abs=0.02)
    assert "did not open" in hand.watchdog.reason


def test_restarts_wait_longer_and_longer_then_it_has_failed(hand) -> None:
    waits = []
    hand.streaming()
    while True:
        hand.watchdog.ended(hand.now_ns, "it was disconnected")
        if hand.watchdog.phase is ProcessPhase.FAILED:
            break
        waits.append(hand.until(RestartAction.START))
        hand.watchdog.started(hand.now_ns)
    assert waits == pytest.approx(LIMITS.back_off_s, abs=0.02)
    assert waits == sorted(waits) and hand.watchdog.restarts == len(waits)
    assert "disconnected" in hand.watchdog.verdict() and "Unplug it" in hand.watchdog.verdict()
    hand.now_ns += 3600 * SECOND
    assert hand.watchdog.due(hand.now_ns) is RestartAction.NOTHING


def test_what_no_restart_can_mend_is_given_up_at_once(hand) -> None:
    hand.watchdog.started(0)
    hand.watchdog.ended(0, "The camera is connected with USB 2.1.", permanent=True)
    assert hand.watchdog.phase is ProcessPhase.FAILED
    assert hand.watchdog.verdict() == "The camera is connected with USB 2.1."


def test_half_a_minute_of_images_forgets_earlier_failures(hand) -> None:
    hand.streaming()
    hand.watchdog.ended(hand.now_ns, "it was disconnected")
    hand.until(RestartAction.START)
    hand.streaming()
    for expected in (1, 0):
        assert hand.watchdog.failures == expected
        hand.now_ns += round(LIMITS.proven_s * SECOND)
        hand.watchdog.image(hand.now_ns)
