from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory
from openbelief.scene_graph import Room, scene_graph


def test_objects_lie_in_the_rooms_that_hold_their_centre_and_views_show_them(flat, tiny_encoder):
    memory = ObjectMemory.build(flat, tiny_encoder)
    west = Room("west", np.array([[-1, -1], [3, -1], [3, 1], [-1, 1]]))
    east = Room("east", np.array([[3, -1], [5, -1], [5, 1], [3, 1]]))
    graph = scene_graph(memory, [west, east])
    assert [(room.name, room.objects) for room in graph.rooms] == [("west", (0, 1)), ("east", (2,)), (None, (3,))]
    assert graph.room_of(2) == "east" and graph.room_of(3) is None
    assert [view.objects for view in graph.views] == [(0, 1, 2, 3)] * 4


def test_without_rooms_no_room_is_invented(flat, tiny_encoder):
    memory = ObjectMemory.build(flat, tiny_encoder)
    assert all(node.room is None for node in memory.objects)
    assert [room.name for room in scene_graph(memory).rooms] == [None]


def test_a_room_need_not_be_convex():
    corner = Room("L", np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]))
    assert corner.contains(np.array([0.5, 1.5])) and not corner.contains(np.array([1.5, 1.5]))


def test_a_room_without_area_is_refused():
    with pytest.raises(ValueError, match="'hall'"):
        Room("hall", np.array([[0, 0], [1, 1]]))
