from __future__ import annotations

import pytest

from openbelief.evaluation.statistics import mcnemar_exact, wilson


def test_eight_against_six_of_ten_is_no_evidence():
    assert mcnemar_exact(2, 0) == 0.5
    assert mcnemar_exact(10, 0) == pytest.approx(2 / 1024)
    assert mcnemar_exact(3, 3) == mcnemar_exact(0, 0) == 1.0


def test_wilson_s_interval_of_the_paper_s_eight_of_ten():
    assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert wilson(0, 5)[0] == 0.0 and wilson(5, 5)[1] == 1.0


def test_impossible_counts_are_refused():
    for counts in ((3, 2), (-1, 2), (0, 0)):
        with pytest.raises(ValueError, match="Successes"):
            wilson(*counts)
    with pytest.raises(ValueError, match="negative"):
        mcnemar_exact(-1, 2)
