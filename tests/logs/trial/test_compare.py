from __future__ import annotations

import json

import pytest

from logs.trial import records
from logs.trial.compare import BY_PERCEPTION, compare_decisions
from logs.trial.records import Check, Checks, Transition

CHECKS = Checks(
    object_id=3,
    frame_stamp_ns=7,
    visibility=Check(value=0.9, threshold=0.25),
    semantic=Check(value=0.60, threshold=0.45),
    geometric=Check(value=0.80, threshold=0.20),
    expected=500,
    occluded=0.0,
    out_of_view=0.1,
    no_depth=0.0,
    see_through=0.0,
    pose_error_m=0.1,
    mask_index=2,
    verdict="confirmed",
    reason='"fire extinguisher" matches (0.60)',
)


def changed(**values: object) -> Checks:
    return CHECKS.model_copy(update=values)


@pytest.mark.parametrize(
    ("now", "field"),
    [
        (changed(semantic=Check(value=0.64, threshold=0.45)), None),
        (changed(mask_index=0, reason='"red extinguisher" matches (0.60)'), None),
        (changed(semantic=Check(value=0.66, threshold=0.45)), "semantic.value"),
        (changed(geometric=Check(value=None, threshold=0.20)), "geometric.value"),
        (changed(visibility=Check(value=0.9001, threshold=0.25)), "visibility.value"),  # no matter of perception
        (changed(semantic=Check(value=0.60, threshold=0.46)), "semantic.threshold"),
        (changed(verdict="no matching mask"), "verdict"),
    ],
)
def test_where_perception_looked_again_values_may_move_a_little_and_verdicts_not_at_all(now, field):
    difference = compare_decisions([CHECKS], [now], BY_PERCEPTION)
    assert (difference and difference.field) == field


def test_without_it_the_same_values_are_different():
    near = changed(semantic=Check(value=0.64, threshold=0.45))
    difference = compare_decisions([CHECKS], [near])
    assert difference is not None and difference.by == pytest.approx(0.04)


def test_another_event_is_a_difference_whatever_the_tolerance():
    then = Transition(source="verify", event="matched", target="confirmed", because="0.60")
    now = Transition(source="verify", event="rejected", target="exclude", because="0.40")
    difference = compare_decisions([then], [now], BY_PERCEPTION)
    assert difference is not None and difference.field == "event" and "0.40" in str(difference)


def test_a_plan_of_an_old_trial_is_read_in_the_new_words():
    old = {"goal": {"x": 1.0, "y": 2.0, "yaw": 0.0}, "length_m": 3.0, "reason": "", "way": [[0.5, 1.0], [1.0, 2.0]]}
    assert records.Plan.model_validate_json(json.dumps(old)).path_prefix == ((0.5, 1.0), (1.0, 2.0))
