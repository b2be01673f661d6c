from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory
from openbelief.rooms import Room, room_at, rooms_of
from openbelief.scene_graph import NO_MAP, TOO_WIDE, scene_graph
from robot_app.pages.document import WORDS_MAX


def test_objects_lie_in_the_rooms_that_hold_their_centre_and_views_show_them(flat, tiny_encoder):
    memory = ObjectMemory.build(flat, tiny_encoder)
    west = Room("west", np.array([[-1, -1], [3, -1], [3, 1], [-1, 1]]))
    east = Room("east", np.array([[3, -1], [5, -1], [5, 1], [3, 1]]))
    graph = scene_graph(memory.with_rooms([west, east]))
    assert [(room.name, room.objects) for room in graph.rooms] == [("west", (0, 1)), ("east", (2,)), (None, (3,))]
    assert [view.objects for view in graph.views] == [(0, 1, 2, 3)] * 4


def test_without_rooms_no_room_is_invented(flat, tiny_encoder):
    memory = ObjectMemory.build(flat, tiny_encoder)
    assert all(node.room is None for node in memory.objects)
    assert [room.name for room in scene_graph(memory).rooms] == [None]


def test_a_room_need_not_be_convex():
    corner = Room("L", np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]))
    assert corner.contains(np.array([0.5, 1.5])) and not corner.contains(np.array([1.5, 1.5]))


def test_the_first_room_that_holds_a_point_is_its_room():
    low, high = Room("low", [[0, 0], [2, 0], [2, 2], [0, 2]]), Room("high", [[1, 0], [3, 0], [3, 2], [1, 2]])
    xy = np.array([1.5, 1.0])
    assert (room_at(xy, [low, high]), room_at(xy, [high, low]), room_at(xy + 5, [low, high])) == ("low", "high", None)


def test_rooms_are_read_back_as_they_were_written():
    entries = [{"name": "hall", "polygon": [[0.0, 0.0], [2.0, 0.0], [0.0, 1.5]]}]
    assert [room.as_json() for room in rooms_of(entries)] == entries


SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]


@pytest.mark.parametrize(
    "entries",
    [
        {"rooms": []},
        None,
        ["hall"],
        [{"name": "hall"}],
        [{"name": "hall", "polygon": SQUARE, "colour": "red"}],
        [{"name": "", "polygon": SQUARE}],
        [{"name": "ha\nll", "polygon": SQUARE}],
        [{"name": 3, "polygon": SQUARE}],
        [{"name": "x" * 61, "polygon": SQUARE}],
        [{"name": "hall", "polygon": [[0, 0], [1, 1]]}],
        [{"name": "hall", "polygon": [[0, 0], [1, 1], [2, 2]]}],
        [{"name": "hall", "polygon": [[0, 0], [1, 1], [2]]}],
        [{"name": "hall", "polygon": [[0, 0], [1, "x"], [2, 0]]}],
        [{"name": "hall", "polygon": [[0, 0], [1, float("nan")], [2, 0]]}],
        [{"name": "hall", "polygon": None}],
        [{"name": "hall", "polygon": SQUARE}, {"name": "hall", "polygon": SQUARE}],
    ],
)
def test_rooms_that_are_none_are_refused_in_one_line(entries):
    with pytest.raises(ValueError, match=r"^[^\n]*[Rr]oom[^\n]*$"):
        rooms_of(entries)


@pytest.mark.parametrize("lacks", [NO_MAP, TOO_WIDE])
def test_what_a_file_lacks_is_short_enough_for_a_page(lacks):
    assert len(lacks) <= WORDS_MAX


def test_at_any_height_above_the_maps_zero_every_object_is_on_a_floor(observe, tiny_encoder):
    things = [observe("chair", at=(0, 0, 1500.0)), observe("lamp", at=(2, 0, 1500.0), mask=1)]
    memory = ObjectMemory.build(things, tiny_encoder)
    (floor,) = scene_graph(memory).floors
    assert [room.objects for room in floor.rooms] == [(0, 1)]
