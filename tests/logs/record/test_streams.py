"""A topic's pace: holes in its stamps are told, at whatever rate it comes."""

from __future__ import annotations

import pytest

from logs.record.streams import StampIntervals

MS = 1_000_000


def paced(stamps_ms: list[float]) -> StampIntervals:
    pace = StampIntervals()
    for stamp_ms in stamps_ms:
        pace.see(round(stamp_ms * MS))
    return pace


@pytest.mark.parametrize("step_ms", [5, 33, 100, 1000])
def test_one_missing_message_is_a_hole_at_any_steady_rate(step_ms: int) -> None:
    pace = paced([k * step_ms for k in range(100) if k != 50])
    assert (pace.holes, pace.backwards) == (1, 0)
    assert pace.longest_hole_s == pytest.approx(2 * step_ms / 1000)


def test_a_source_that_is_not_steady_has_no_holes_where_it_is_as_always() -> None:
    uneven = [k * 100 + (k % 3) * 30 for k in range(60)]
    slower = [uneven[-1] + 200 * k for k in range(60)]
    assert paced(uneven).holes == 0
    assert paced([*uneven, *slower[1:]]).holes <= 8  # a new rate is the usual one soon


def test_stamps_that_do_not_advance_are_counted_and_are_no_hole() -> None:
    pace = paced([*range(0, 1000, 10), 990, 500, *range(510, 1000, 10)])
    assert (pace.holes, pace.backwards) == (0, 2)
