from __future__ import annotations

import numpy as np

from openbelief import ObjectMemory
from openbelief.evaluation.rooms import evaluate_rooms
from openbelief.evaluation.truth import TrueObject
from openbelief.rooms import Room


def box(name, x0, x1):
    return Room(name, [[x0, -1], [x1, -1], [x1, 1], [x0, 1]])


def test_objects_count_where_their_room_stands_for_their_true_one(flat, tiny_encoder):
    """Chairs at x = 0 and 2, a lamp at 4; the wall at 6 is not counted."""
    memory = ObjectMemory.build(flat, tiny_encoder)
    true = [box("hall", -1, 3), box("study", 3, 7)]
    exact = evaluate_rooms(memory.with_rooms([box("a", -1, 3), box("b", 3, 7)]), true, {})
    assert (exact["objects"], exact["right"], exact["matched"]) == (3, 1.0, {"a": "hall", "b": "study"})
    split = evaluate_rooms(memory.with_rooms([box("a", -1, 1), box("b", 1, 3), box("c", 3, 7)]), true, {})
    assert split["right"] == 2 / 3
    merged = evaluate_rooms(memory.with_rooms([box("a", -1, 7)]), true, {})
    assert merged["right"] == 2 / 3 and [w["true"] for w in merged["wrong"]] == ["study"]
    assert evaluate_rooms(memory, true, {})["right"] == 0.0


def test_what_lies_in_a_true_object_is_in_that_objects_room(flat, tiny_encoder):
    memory = ObjectMemory.build(flat, tiny_encoder).with_rooms([box("a", -1, 3), box("b", 3, 7)])
    wide = TrueObject(1, "long shelf", np.array([[1.5, -1, -1], [6.5, 1, 1]]))  # its middle is in the study
    true = [box("hall", -1, 3), box("study", 3, 7)]
    assert evaluate_rooms(memory, true, {1: wide})["wrong"] == [
        {"object": 1, "label": "chair", "room": "a", "true": "study"}
    ]


def test_a_memory_of_another_site_counts_nothing(flat, tiny_encoder):
    memory = ObjectMemory.build(flat, tiny_encoder)
    assert evaluate_rooms(memory, [box("far", 90, 99)], {})["right"] is None


def test_a_derived_name_is_right_where_people_mean_the_same_by_it(flat, tiny_encoder):
    memory = ObjectMemory.build(flat, tiny_encoder)
    true = [box("corridor", -1, 3), box("kids room", 3, 7)]

    def named(one, other, given=False):
        rooms = [Room(name, at.polygon_xy, given) for name, at in zip((one, other), true, strict=True)]
        return evaluate_rooms(memory.with_rooms(rooms), true, {})["named"]

    assert named("hallway 2", "kids room") == {"right": 2, "wrong": 0, "numbered": 0}
    assert named("entrance", "room 1") == {"right": 0, "wrong": 1, "numbered": 1}
    assert named("hallway", "kids room", given=True) == {"right": 0, "wrong": 0, "numbered": 0}
