from __future__ import annotations

import pytest

from behaviors.policy import MissionPolicy
from behaviors.safety_policy import SafetyPolicy
from openbelief import Parameters


@pytest.mark.parametrize(
    ("settings", "values", "said"),
    [
        (Parameters, {"tau_g": 2}, "Parameter tau_g must be at most 1, got 2."),
        (Parameters, {"alpha": 0.0}, "Parameter alpha must be greater than 0, got 0.0."),
        (
            Parameters,
            {"weight": "root"},
            "Parameter weight should be one of 'sqrt', 'uniform' or 'linear', got 'root'.",
        ),
        (Parameters, {"m_min": True}, "Parameter m_min should be a whole number, got True."),
        (MissionPolicy, {"pose_error_m": float("inf")}, "Mission policy pose_error_m must be finite, got inf."),
        (MissionPolicy, {"motion": "always"}, "Mission policy motion should be one of 'ask' or 'allow', got 'always'."),
        (SafetyPolicy, {"jump_m": "1"}, "Safety limit jump_m should be a number, got '1'."),
        (SafetyPolicy, {"disk_min_bytes": -1}, "Safety limit disk_min_bytes must be at least 0, got -1."),
        (SafetyPolicy, {"keep_out": [[[0, 0], [1, float("nan")]]]}, "Safety limit keep_out.0.1.1 must be finite"),
    ],
)
def test_a_wrong_setting_is_refused_in_one_line_that_names_it(settings, values, said):
    with pytest.raises(ValueError, match=r"^[^\n]+$") as refused:
        settings(**values)
    assert str(refused.value).startswith(said)


@pytest.mark.parametrize(("settings", "noun"), [(Parameters, "parameter"), (MissionPolicy, "mission policy")])
def test_an_unknown_setting_is_refused_with_the_known_ones(settings, noun):
    with pytest.raises(ValueError, match=rf"^Unknown {noun} 'tau'; known are \w+, [^\n]+$"):
        settings.from_dict({"tau": 0.5})
