"""The real clock, on a machine whose two clocks are moved by hand."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from drivers.clock import SystemClock

S = 1_000_000_000
EPOCH_NS = 1_700_000_000 * S


@dataclass
class Machine:
    """elapsed_ns: since it booted. set_by_ns: how far somebody set its wall clock."""

    elapsed_ns: int = 7 * S
    set_by_ns: int = 0

    def clock(self) -> SystemClock:
        return SystemClock(lambda: EPOCH_NS + self.elapsed_ns + self.set_by_ns, lambda: self.elapsed_ns)


@pytest.mark.parametrize("by_s", [3600, -3600, 1])
def test_durations_are_right_though_the_system_clock_is_set_and_how_far_is_told(by_s):
    machine = Machine()
    clock = machine.clock()
    begun_ns = clock.now_ns()
    assert begun_ns == EPOCH_NS + 7 * S and clock.set_by_s() == 0.0
    machine.elapsed_ns += 10 * S
    machine.set_by_ns = by_s * S
    assert clock.now_ns() - begun_ns == 10 * S
    assert clock.set_by_s() == by_s


def test_a_clock_that_begins_anew_has_the_time_that_was_set():
    machine = Machine()
    machine.clock()
    machine.set_by_ns = 3600 * S
    assert machine.clock().now_ns() == EPOCH_NS + 3607 * S
