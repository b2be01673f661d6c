from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory
from openbelief.derived_rooms import given_win, with_derived_rooms
from openbelief.room_names import NAMES, RoomName, decided, unique_names
from openbelief.rooms import Room
from openbelief.surroundings import StoreyMap, Surroundings
from openbelief.traversability import OccupancyGrid
from support.encoders import AxisEncoder

KINDS = {"stove": "kitchen", "sink": "kitchen", "fridge": "kitchen", "bed": "bedroom", "pillow": "bedroom"}


def _place_of(phrase: str) -> int:
    word = KINDS.get(phrase.split()[-1], phrase)
    return NAMES.index(word) if word in NAMES else -1


def places() -> AxisEncoder:
    """Words in the plane of their place: "kitchen" and what stands in one are alike."""
    return AxisEncoder(_place_of, len(NAMES) + 1, "places")


def walls(width=8.0, depth=4.0, middle=4.0, turned=False):
    """Two rooms beside each other with a door, 5 cm cells."""
    cells = np.zeros((round(depth / 0.05), round(width / 0.05)), np.int8)
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = 100, 100, 100, 100
    column = round(middle / 0.05)
    cells[:, column : column + 2] = 100
    cells[30:50, column : column + 2] = 0
    return OccupancyGrid(cells, 0.05, (0.0, 0.0))


@pytest.fixture
def site(observe):
    """A kitchen in the west, a bedroom in the east, and a map that shows the wall between them."""
    west = [("stove", (1, 1, 0.4)), ("sink", (1, 3, 0.4)), ("fridge", (2.5, 3, 0.4))]
    east = [("bed", (6, 1, 0.3)), ("pillow", (6, 3, 0.5)), ("white wall", (5, 2, 1.0))]
    seen = [
        observe(phrase, at=at, frame=0, mask=k, look=k, dim=places().dim, recording="walk")
        for k, (phrase, at) in enumerate(west + east)
    ]
    around = Surroundings(maps=(StoreyMap("walk", walls()),))
    return ObjectMemory.build(seen, places(), surroundings=around)


def test_rooms_are_found_on_the_map_and_named_by_what_stands_in_them(site):
    memory = with_derived_rooms(site)
    assert {node.label: node.room for node in memory.objects} == {
        "stove": "kitchen",
        "sink": "kitchen",
        "fridge": "kitchen",
        "bed": "bedroom",
        "pillow": "bedroom",
        "white wall": "bedroom",
    }
    kitchen = next(room for room in memory.rooms if room.name == "kitchen")
    assert not kitchen.given and "stove" in kitchen.because and "kitchen" in kitchen.because
    assert memory.content_hash == site.content_hash and memory.state_hash != site.state_hash


def test_they_are_found_again_the_same_and_read_back_from_the_file(site, tmp_path):
    memory = with_derived_rooms(site)
    assert with_derived_rooms(memory).state_hash == memory.state_hash
    memory.save(tmp_path / "site.belief")
    again = ObjectMemory.open(tmp_path / "site.belief")
    assert again.state_hash == memory.state_hash
    assert [room.as_json() for room in again.rooms] == [room.as_json() for room in memory.rooms]


def test_given_rooms_win_and_derived_ones_fill_the_rest(site):
    studio = Room("studio", [[0, 0], [4, 0], [4, 4], [0, 4]])
    memory = with_derived_rooms(site.with_rooms([studio]))
    assert [(room.name, room.given) for room in memory.rooms] == [("studio", True), ("bedroom", False)]
    assert {node.room for node in memory.objects} == {"studio", "bedroom"}
    whole = Room("loft", [[0, 0], [8, 0], [8, 4], [0, 4]])
    assert [room.name for room in with_derived_rooms(site.with_rooms([whole])).rooms] == ["loft"]


def test_a_given_name_is_not_used_twice(site):
    derived = with_derived_rooms(site).rooms
    shed = Room("kitchen", [[20, 0], [22, 0], [22, 2]])
    names = [room.name for room in given_win([shed], derived)]
    assert names[0] == "kitchen" and sorted(names[1:]) == ["bedroom", "kitchen 2"]


def test_without_maps_and_keyframes_no_room_is_invented(site):
    assert with_derived_rooms(site.with_surroundings(Surroundings())).rooms == ()


def test_without_a_map_rooms_are_drawn_from_what_was_seen_and_that_is_said(site):
    from openbelief.scene_graph import scene_graph
    from tests.openbelief.test_floors import site as seen_from

    seen = seen_from([(x, 2, 1.2, 0.0) for x in (1, 2, 3, 6, 7)])
    memory = with_derived_rooms(site.with_surroundings(seen))
    assert memory.rooms and not any(room.given for room in memory.rooms)
    assert "No navigation map was recorded" in scene_graph(memory).lacks
    assert scene_graph(memory.with_rooms([])).lacks is None  # no room was drawn


def test_a_room_whose_objects_speak_for_nothing_has_a_number_and_says_why(observe):
    seen = [observe("thing", at=(1, 1, 0.4), dim=places().dim, recording="walk")]
    around = Surroundings(maps=(StoreyMap("walk", walls()),))
    rooms = with_derived_rooms(ObjectMemory.build(seen, places(), surroundings=around)).rooms
    assert sorted(room.name for room in rooms) == ["room 1", "room 2"]
    assert sorted(room.because for room in rooms)[0].startswith("no name")


def test_two_bedrooms_are_told_apart():
    names = [RoomName("bedroom", 2.0, ""), RoomName(None, 0, ""), RoomName("bedroom", 3.0, "")]
    assert unique_names(names) == ["bedroom 2", "room 1", "bedroom"]
    assert unique_names(names, taken=["bedroom"])[2] == "bedroom 2"


def test_of_two_names_alike_a_room_takes_the_one_that_no_other_room_has_better_evidence_for():
    alike = RoomName(None, 2.3, "no name is ahead", ("bedroom", "living room"), "sofa")
    bedroom, shed = RoomName("bedroom", 3.9, "a bed"), RoomName(None, 0.0, "")
    first, second, third = decided([alike, bedroom, shed])
    assert first.name == "living room" and (second, third) == (bedroom, shed)
    assert "alike (2.3)" in first.because and "another room is more bedroom (3.9)" in first.because
    assert decided([alike, RoomName("bedroom", 2.5, "")])[0] == alike  # hardly more than this one
    assert decided([alike, bedroom, RoomName("living room", 3.9, "")])[0] == alike
    assert decided([alike]) == [alike]


def test_storeys_above_each_other_have_rooms_of_their_own(observe):
    things = [("stove", (1, 1, 0.4)), ("bed", (6, 1, 0.4)), ("bed", (1, 1, 3.4)), ("stove", (6, 1, 3.4))]
    from tests.openbelief.test_floors import site as seen_from

    seen = [
        observe(phrase, at=at, frame=k, look=k, dim=places().dim, recording="walk")
        for k, (phrase, at) in enumerate(things)
    ]
    maps = [StoreyMap("walk", walls(), 0.0), StoreyMap("walk", walls(), 3.0)]
    around = seen_from([(2, 2, 1.2, 0.0), (2, 2, 1.2, 3.0)], maps)
    memory = with_derived_rooms(ObjectMemory.build(seen, places(), surroundings=around))
    assert len(memory.rooms) == 4 and len({node.room for node in memory.objects}) == 4
    assert all(room.heights_m for room in memory.rooms)
