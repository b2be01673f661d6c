"""What is no observation is refused at the door, in one line that names the field; what is one stays what it was."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief import Observation
from openbelief.observation import Intrinsics, Mask, RgbdFrame

POINTS = np.arange(30).reshape(10, 3) / 100  # float64
FEATURE = np.eye(4, dtype=np.float32)[0]
GOOD = {"frame": 0, "mask": 0, "phrase": "red chair", "confidence": 0.9, "points": POINTS, "feature": FEATURE}
BAD = {
    "frame": ["a", None, 1.5, -1, True, np.zeros((3, 3))],
    "mask": [float("nan"), "0", None, -2],
    "phrase": [3, b"chair", ["chair"]],
    "confidence": ["a", None, 0, 1.5, float("nan"), True, np.array([0.5]), np.ones((4, 4)), 0.5j],
    "points": [
        "abc",
        None,
        [[1, 2], [3]],
        [[None, 1, 2]],
        POINTS.astype(complex),
        POINTS > 0,
        POINTS[:0],
        POINTS * 1e300,
    ],
    "feature": ["x", None, [], FEATURE[None], FEATURE * 2, FEATURE * np.nan, FEATURE.astype(complex)],
    "provenance": ["walk", {"recording": "walk"}, 3],
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("field", "value"), [(field, value) for field, values in BAD.items() for value in values])
def test_what_is_no_observation_is_refused_in_one_line_that_names_the_field(field, value):
    with pytest.raises(ValueError, match=rf"^[^\n]*{field}[^\n]*$") as refused:
        Observation(**{**GOOD, field: value})
    assert type(refused.value) is ValueError and len(str(refused.value)) < 160


def test_numpy_s_numbers_are_numbers():
    view = Observation(**{**GOOD, "frame": np.int64(7), "mask": np.uint8(2), "confidence": np.float32(0.5)})
    assert (view.frame, view.mask, view.confidence) == (7, 2, 0.5)
    assert [type(each) for each in (view.frame, view.mask, view.confidence)] == [int, int, float]


def test_what_the_caller_does_to_his_arrays_afterwards_changes_no_observation():
    points, feature = POINTS.copy(), FEATURE.copy()
    view = Observation(**{**GOOD, "points": points, "feature": feature})
    points += 5
    feature[:] = 0
    assert (view.points == POINTS.astype(np.float32)).all() and (view.feature == FEATURE).all()
    for own in (view.points, view.feature):
        with pytest.raises(ValueError, match="read-only"):
            own[...] = 0


def test_what_holds_arrays_is_equal_to_itself_and_can_be_looked_for_in_a_list_and_a_set():
    mask = [Mask(0, np.ones((2, 2), bool), "box", 0.9, FEATURE) for _ in range(2)]
    camera = Intrinsics(2, 2, 1.0, 1.0, 0.5, 0.5)
    frame = [RgbdFrame(0, 0, np.zeros((2, 2, 3), np.uint8), np.ones((2, 2)), camera, np.eye(4)) for _ in range(2)]
    for one, other in (mask, frame, [Observation(**GOOD), Observation(**GOOD)]):
        assert one == one and one != other and one in [other, one] and len({one, other, one}) == 2
