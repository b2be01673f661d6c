from __future__ import annotations

import pytest

from openbelief import Parameters


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("weight", "root"),
        ("fusion", "calibrate"),
        ("trust_counts", "frame"),
        ("k_max", 1.5),
        ("k_max", True),
        ("m_min", None),
        ("alpha", "0.5"),
        ("tau_g", True),
        ("regularize", 0),
        ("synonym_threshold", "high"),
        ("tau_nu", float("nan")),
        ("min_points", -1),
        ("depth_min_m", 9.0),
    ],
)
def test_a_value_of_the_wrong_kind_or_range_is_refused_with_its_name(name, value):
    with pytest.raises(ValueError, match=r"^Parameter \w+ (should|must) [^\n]+$") as refused:
        Parameters.from_dict({name: value})
    assert name in str(refused.value)


def test_an_unknown_parameter_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match="Unknown parameter 'tau'; known are alpha,"):
        Parameters.from_dict({"tau": 0.5})


def test_whole_numbers_are_numbers_and_what_may_be_left_out_may():
    given = Parameters(alpha=1, tau_q=None, synonym_threshold=0.9)
    assert Parameters.from_dict(given.to_dict()) == given
