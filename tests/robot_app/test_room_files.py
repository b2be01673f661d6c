from __future__ import annotations

import json

import numpy as np
import pytest

from openbelief.polygon import crossing
from robot_app.cli import Failure
from robot_app.room_files import read_rooms

SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]


@pytest.mark.parametrize(
    "corners",
    [[[0, 0], [4, 4], [4, 0], [0, 5]], [[2, 6], [4, 0], [-1, 4], [5, 4], [0, 0]], [[0, 0], [0, 4], [4, 0], [3, 9]]],
)
def test_corners_that_are_not_in_order_are_refused_and_the_edges_named(tmp_path, corners):
    path = tmp_path / "rooms.json"
    path.write_text(json.dumps([{"name": "hall", "polygon": corners}]))
    with pytest.raises(Failure, match=r"Room 'hall': its edges .* and .* cross; give the corners in order"):
        read_rooms(path)


@pytest.mark.parametrize(
    "corners",
    [
        SQUARE,
        SQUARE[::-1],
        [*SQUARE, SQUARE[0]],
        [SQUARE[0], *SQUARE],
        [[0, 0], [2, 0], [4, 0], [4, 4], [2, 1], [0, 4]],
        [[0, 0], [4, 0], [2, 2], [4, 4], [0, 4], [2, 2]],  # two triangles that touch
    ],
)
def test_outlines_that_touch_themselves_are_outlines(corners):
    assert crossing(np.array(corners)) is None


def test_rooms_of_a_file_are_given_whatever_it_says_and_whoever_wrote_it(tmp_path):
    path = tmp_path / "rooms.json"
    derived = {"name": "hall", "polygon": SQUARE, "given": False, "because": "a lamp speaks for hall"}
    path.write_text(json.dumps({"rooms": [derived]}), encoding="utf-8-sig")
    (room,) = read_rooms(path)
    assert room.given and room.because == "" and room.name == "hall"
