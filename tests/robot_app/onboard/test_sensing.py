"""One sensor's life in onboard: whatever it does is said once, and it is opened again. Time is moved by hand."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field

import pytest
import structlog

from drivers.clock import SystemClock
from drivers.ports import LinkLost, PortError
from drivers.ros.diagnosis import Diagnosis, Severity
from robot_app.onboard.sensing import BACK_OFF_S, Opened, Sensing

S = 1_000_000_000
HOUR = 3600.0
FINE = Diagnosis("camera state", Severity.OK, "streaming")
UNPLUGGED = "No RealSense is connected: check the cable."


@dataclass
class Stage:
    """A machine's clocks, and a sensor that does at each step what the script says; `wait` lets its time pass."""

    end_s: float = 600.0
    elapsed_ns: int = 0
    set_by_ns: int = 0
    openings: list[float] = field(default_factory=list)
    closings: list[float] = field(default_factory=list)
    steps: list[float] = field(default_factory=list)
    stamps: list[int] = field(default_factory=list)
    says: list[Diagnosis] = field(default_factory=list)
    fails_to_open: Callable[[float], Exception | None] = lambda _: None
    fails_at: Callable[[float], Exception | None] = lambda _: None
    happens: Callable[[float], None] = lambda _: None

    @property
    def now_s(self) -> float:
        return self.elapsed_ns / S

    def wait(self, seconds: float) -> bool:
        self.elapsed_ns += round(max(seconds, 0.1) * S)
        self.happens(self.now_s)
        return self.now_s >= self.end_s

    def clock(self) -> SystemClock:
        return SystemClock(wall_ns=lambda: self.elapsed_ns + self.set_by_ns, monotonic_ns=lambda: self.elapsed_ns)

    def open(self, clock: SystemClock, opened: ExitStack) -> Opened:
        self.openings.append(self.now_s)
        if error := self.fails_to_open(self.now_s):
            raise error
        opened.callback(lambda: self.closings.append(self.now_s))
        return Opened([Step(self, clock)], lambda: [FINE, *self.says])

    def run(self) -> None:
        Sensing("camera", self.open, self.wait, self.clock).run()


@dataclass
class Step:
    stage: Stage
    clock: SystemClock

    def step(self) -> None:
        if error := self.stage.fails_at(self.stage.now_s):
            raise error
        self.stage.steps.append(self.stage.now_s)
        self.stage.stamps.append(self.clock.now_ns())


@pytest.fixture
def said() -> Iterator[list[dict]]:
    """What reached the log."""
    with structlog.testing.capture_logs() as lines:
        yield lines


def reasons(said: list[dict]) -> list[str]:
    return [line["reason"] for line in said if "reason" in line]


def test_a_camera_that_is_plugged_in_later_is_found_and_its_absence_said_once(said):
    stage = Stage(fails_to_open=lambda now_s: PortError(UNPLUGGED) if now_s < 60 else None)
    stage.run()
    assert reasons(said) == [UNPLUGGED]
    assert said[-1]["state"] == "open"
    assert 60 <= stage.steps[0] <= 60 + BACK_OFF_S[-1] + 1 and stage.steps[-1] > 598


def test_attempts_come_less_often_the_longer_it_fails():
    stage = Stage(fails_to_open=lambda _: PortError(UNPLUGGED), end_s=109.0)
    stage.run()
    assert stage.openings == [0.0, 1.0, 3.0, 8.0, 18.0, 48.0, 78.0, 108.0]


def test_a_camera_that_failed_for_good_is_closed_and_opened_anew(said):
    stage = Stage(fails_at=lambda now_s: LinkLost("5 hardware resets did not help") if 100 <= now_s < 101 else None)
    stage.run()
    assert reasons(said) == ["5 hardware resets did not help"]
    assert len(stage.openings) == len(stage.closings) == 2
    assert stage.openings[1] == pytest.approx(stage.closings[0] + BACK_OFF_S[0]), "it had proven itself for 100 s"


def test_a_fault_of_ours_is_logged_with_its_cause_and_ends_nothing(said):
    stage = Stage(fails_at=lambda now_s: ZeroDivisionError("of ours") if 10 <= now_s < 11 else None)
    stage.run()
    [line] = [line for line in said if "reason" in line]
    assert line["reason"] == "ZeroDivisionError: of ours" and isinstance(line["exc_info"], ZeroDivisionError)
    assert stage.steps[-1] > 598


def test_what_the_sensor_says_is_logged_when_it_begins_to_say_it(said):
    dirty = Diagnosis("lidar health", Severity.WARN, "the window is dirty", "clean it")
    gone = Diagnosis("lidar health", Severity.ERROR, "the network link dropped")
    stage = Stage(end_s=60.0)
    script = {10: [dirty], 20: [dirty, gone], 30: [], 40: [dirty]}
    stage.happens = lambda now_s: setattr(stage, "says", script.get(int(now_s), stage.says))
    stage.run()
    assert [line["says"] for line in said if "says" in line] == [
        "the window is dirty; clean it.",
        "the network link dropped.",
        "the window is dirty; clean it.",
    ]


@pytest.mark.parametrize("by_s", [HOUR, -HOUR, 0.6, -0.6])
def test_after_the_system_clock_was_set_stamps_are_right_again_within_seconds(said, by_s):
    stage = Stage(end_s=100.0)
    stage.happens = lambda now_s: setattr(stage, "set_by_ns", round(by_s * S) if now_s >= 50 else 0)
    stage.run()
    [reason] = reasons(said)
    assert reason == f"The system clock was set by {by_s:+.1f} s: the camera begins anew."
    wrong = [
        now_s
        for now_s, stamp_ns in zip(stage.steps, stage.stamps, strict=True)
        if now_s >= 50 and stamp_ns != round(now_s * S) + stage.set_by_ns
    ]
    assert max(wrong) <= 51.2 and stage.steps[-1] > 98


def test_a_clock_that_is_slewed_changes_nothing(said):
    stage = Stage(end_s=100.0)
    stage.happens = lambda now_s: setattr(stage, "set_by_ns", round(0.004 * S))
    stage.run()
    assert reasons(said) == [] and len(stage.openings) == 1


def test_to_stop_closes_the_sensor():
    stage = Stage(end_s=1.0)
    stage.run()
    assert len(stage.openings) == len(stage.closings) == 1
