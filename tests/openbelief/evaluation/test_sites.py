"""Sites are summed with the interval that so many questions allow."""

from __future__ import annotations

import pytest

from openbelief.evaluation.sites import COLUMNS, ROOM_COLUMNS, summed
from openbelief.evaluation.statistics import wilson


def test_counts_are_summed_over_sites_with_their_wilson_interval():
    one = {name: {"right": 45, "of": 50} for name in (*COLUMNS, *ROOM_COLUMNS)} | {
        "by_kind": {"room": {"right": 3, "of": 9}}
    }
    two = {name: {"right": 49, "of": 50} for name in (*COLUMNS, *ROOM_COLUMNS)} | {
        "by_kind": {"direct": {"right": 9, "of": 9}}
    }
    result = summed([one, two])
    assert result["grounded"] == {"right": 94, "of": 100, "rate": 0.94, "interval": list(wilson(94, 100))}
    assert (result["by_kind"]["room"]["right"], result["by_kind"]["direct"]["rate"]) == (3, pytest.approx(1.0))
