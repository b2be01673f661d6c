from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from logs.trial.inputs import Transform
from openbelief.pose import is_rigid, quaternion_from_rpy, transform

RIGID = transform([1.0, 2.0, 3.0], quaternion_from_rpy(0.1, -0.4, 2.0))
MIRROR = RIGID @ np.diag([1.0, 1.0, -1.0, 1.0])
LAST_ROW = RIGID + np.eye(4)[3][:, None] * np.array([0.1, 0.0, 0.0, 0.0])


def test_a_rigid_transform_survives_its_record() -> None:
    back = Transform.model_validate_json(Transform.of(7, "camera", RIGID).model_dump_json())
    np.testing.assert_array_equal(back.matrix(), RIGID)


@pytest.mark.parametrize(
    "T",
    [RIGID * 2.0, MIRROR, LAST_ROW, np.zeros((4, 4)), RIGID * np.nan, RIGID[:3], np.ones((5, 5))],
    ids=["scaled", "mirrored", "last row", "zero", "NaN", "12 numbers", "25 numbers"],
)
def test_what_is_no_rigid_transform_is_refused_where_it_is_read(T: np.ndarray) -> None:
    with pytest.raises(ValidationError, match=r"no rigid transform|finite"):
        Transform.of(7, "camera", T)


def test_a_rotation_of_float32_is_rigid() -> None:
    assert is_rigid(RIGID.astype(np.float32).astype(float))
