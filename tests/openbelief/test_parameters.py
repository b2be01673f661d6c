from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory, Parameters


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
        ("tau_v", 5.0),
        ("tau_v", -1.01),
        ("synonym_threshold", 7.0),
        ("tau_q", -4.0),
        ("tau_q", float("inf")),
        ("extent_alarm_m", -1.0),
        ("extent_alarm_ratio", 0.0),
        ("gamma", 0.0),
        ("alpha", 0.0),
        ("m_min", 0),
        ("voxel_m", 10**400),
        ("k_max", np.float64(2.0)),
        ("alpha", np.array([0.5])),
    ],
)
def test_a_value_of_the_wrong_kind_or_range_is_refused_with_its_name(name, value):
    with pytest.raises(ValueError, match=r"^Parameter \w+ (should|must) [^\n]+$") as refused:
        Parameters.from_dict({name: value})
    assert name in str(refused.value)


def test_a_number_is_the_same_however_it_is_written(tiny_encoder, flat):
    for given in (Parameters(tau_g=1, k_max=2), Parameters(tau_g=np.float64(1), k_max=np.int64(2))):
        assert given == Parameters(tau_g=1.0, k_max=2)
        assert (type(given.tau_g), type(given.k_max)) == (float, int)
        hashes = {ObjectMemory.build(flat, tiny_encoder, p).content_hash for p in (given, Parameters(tau_g=1.0))}
        assert len(hashes) == 1
    assert Parameters(tau_v=np.float32(0.5), regularize=np.bool_(False)) == Parameters(tau_v=0.5, regularize=False)


def test_an_unknown_parameter_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match="Unknown parameter 'tau'; known are alpha,"):
        Parameters.from_dict({"tau": 0.5})


def test_whole_numbers_are_numbers_and_what_may_be_left_out_may():
    given = Parameters(alpha=1, tau_q=None, synonym_threshold=0.9)
    assert Parameters.from_dict(given.to_dict()) == given
