from __future__ import annotations

import numpy as np
import pytest

from openbelief.stored_observations import StoredKeys


def test_keys_are_made_of_the_columns_when_they_are_asked_for():
    keys = StoredKeys(["a", "b"], np.array([0, 1, 1], "<i4"), np.array([5, 6, 1 << 40], "<i8"), np.array([0, 2, 3]))
    assert list(keys) == [("a", 5, 0), ("b", 6, 2), ("b", 1 << 40, 3)]
    assert keys[-1] == ("b", 1 << 40, 3) and list(keys[1:]) == list(keys)[1:]
    assert all(type(part) is kind for key in keys for part, kind in zip(key, (str, int, int), strict=True))
    with pytest.raises(IndexError):
        keys[3]


@pytest.mark.parametrize("recording", [[0, 2], [-1, 0]])
def test_a_recording_without_a_name_is_refused(recording):
    with pytest.raises(ValueError, match="has no name"):
        StoredKeys(["a", "b"], np.array(recording), np.array([1, 2]), np.array([0, 0]))
    assert len(StoredKeys([], *np.zeros((3, 0), np.int64))) == 0
