"""Found, unsure or not found, and what the operator is told about it."""

from __future__ import annotations

import pytest

from openbelief.grounded.doubt import judge
from openbelief.grounded.options import GroundedOptions
from openbelief.grounded.reader import GroundedReader
from openbelief.rooms import Room
from tests.openbelief.grounded.conftest import ENCODER

KITCHEN = Room("kitchen", [[0, 0], [5, 0], [5, 5], [0, 5]])
OFFICE = Room("office", [[5, 0], [10, 0], [10, 5], [5, 5]])


@pytest.fixture
def memory(site):
    site.add("toaster", (1, 1))
    site.add("kitchen cabinet", (2, 1), (1.0, 0.6, 0.9))
    site.add("printer", (7, 1))
    site.add(["office chair", "swivel chair"], (8, 2))
    site.add("desk", (8, 3), (1.2, 0.6, 0.7))
    return site.memory()


def test_what_is_there_is_found(memory):
    answer = memory.answer("take me to the toaster")
    assert (answer.answer, answer.because, answer.candidates[0].object_id) == ("found", "", 0)
    assert answer.understood["target"] == "toaster" and answer.did_you_mean == ()


def test_what_is_not_there_is_not_found_and_the_three_nearest_are_offered(memory):
    answer = memory.answer("find the saxophone")
    assert answer.answer == "not found" and "saxophone" in answer.because
    assert len(answer.offers) == 3 and len(set(answer.offers)) == 3


def test_a_thing_that_stands_elsewhere_is_not_found_in_the_room_that_was_asked_for(memory):
    answer = memory.with_rooms([KITCHEN, OFFICE]).answer("the toaster in the office")
    assert answer.answer == "not found" and "in the office" in answer.because
    assert answer.offers[0] == 0  # the toaster, in the kitchen


def test_where_any_thing_would_do_those_of_the_room_are_offered(memory):
    answer = memory.with_rooms([KITCHEN, OFFICE]).answer("something purple in the office")
    assert answer.answer == "unsure" and set(answer.offers) == {2, 3, 4}


def test_a_room_that_does_not_exist_is_said_and_makes_it_unsure(memory):
    answer = memory.with_rooms([KITCHEN, OFFICE]).answer("the toaster in the attic")
    assert answer.answer == "unsure" and answer.understood["unused"] == ["attic"]
    assert "no room called 'attic'" in answer.because and "kitchen, office" in answer.because


def test_a_room_is_the_same_by_its_name_in_another_language(memory):
    kueche = Room("Küche", KITCHEN.polygon_xy)
    for rooms in ([KITCHEN, OFFICE], [kueche, OFFICE]):
        for sentence in ("the toaster in the kitchen", "der Toaster in der Küche", "le toaster dans la cuisine"):
            answer = memory.with_rooms(rooms).answer(sentence)
            assert (answer.answer, answer.candidates[0].object_id) == ("found", 0)


def test_an_anchor_that_is_not_on_the_map_is_said_and_makes_it_unsure(memory):
    answer = memory.answer("the printer next to the aquarium")
    assert answer.answer == "unsure" and answer.candidates[0].object_id == 2
    assert answer.understood["unused"] == ["aquarium"]


def test_a_relation_that_does_not_hold_makes_it_unsure(memory):
    answer = memory.answer("the toaster on the desk")
    assert answer.answer == "unsure" and "on desk" in answer.because


def test_a_relation_to_any_thing_of_the_name_holds(site):
    """There are two tables; the better named one has nothing on it."""
    site.add("table", (0, 0), (1.0, 1.0, 0.7), looks=9)
    site.add(["coffee table", "table"], (5, 0), (1.0, 1.0, 0.4))
    site.add("vase", (5, 0, 0.4), 0.2)
    answer = site.memory().answer("the vase on the table")
    assert (answer.answer, answer.candidates[0].object_id) == ("found", 2)


@pytest.mark.parametrize("sentence", ["the other one", "the blue one", "not the desk", "everything but the desk"])
def test_a_sentence_that_names_no_thing_and_no_place_makes_it_unsure(memory, sentence):
    assert memory.answer(sentence).answer == "unsure"


def test_a_room_is_no_thing_to_drive_to_and_a_thing_in_it_is_offered(memory):
    answer = memory.with_rooms([KITCHEN, OFFICE]).answer("go to the kitchen")
    assert answer.answer == "unsure" and "'kitchen' is a place" in answer.because
    assert answer.candidates[0].object_id in (0, 1) and answer.understood["place"] == "kitchen"


def test_what_no_phrase_says_of_a_thing_makes_it_no_other_thing(site):
    site.add("mug", (0, 0))
    site.add("kettle", (3, 0))
    memory = site.memory()
    for sentence in ("a cup with a flower pattern", "the mug for the coffee", "white coffee mug"):
        assert (memory.answer(sentence).answer, memory.answer(sentence).candidates[0].object_id) == ("found", 0)


def test_alternatives_are_as_good_as_the_better_one(memory):
    housed = memory.with_rooms([KITCHEN, OFFICE])
    assert housed.answer("a saxophone or a toaster").candidates[0].object_id == 0
    either = housed.answer("the printer in the kitchen or the office")
    assert (either.answer, either.candidates[0].object_id) == ("found", 2)


def test_a_place_that_the_maps_own_rooms_contradict_makes_it_unsure(memory):
    derived = [Room(r.name, r.polygon_xy, given=False, because="test") for r in (KITCHEN, OFFICE)]
    answer = memory.with_rooms(derived).answer("the toaster in the office")
    assert answer.answer == "unsure" and "in the office" in answer.because


def test_which_one_of_none_makes_it_unsure(memory):
    answer = memory.with_rooms([KITCHEN, OFFICE]).answer("the second printer, not in the office")
    assert answer.answer != "found"


def test_a_second_one_where_there_is_only_one_makes_it_unsure(memory):
    answer = memory.answer("the second toaster")
    assert answer.answer == "unsure" and "only 1" in answer.because


def test_only_what_is_not_wanted_is_not_found(site):
    site.add(["red chair", "red chair", "chair"], (0, 0))
    site.add("piano", (5, 0))
    answer = site.memory().answer("a chair, but not the red one")
    assert answer.answer == "not found"


def test_a_word_of_manner_is_reported_and_changes_nothing(memory):
    answer = memory.answer("go to the toaster quickly")
    assert answer.answer == "found" and answer.understood["unused"] == ["quickly"]


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("the printer next to the toastre", "toaster"),
        ("the printer in the kithcen", "kitchen"),
        ("the printer in the bedrom", "bedroom"),
    ],
)
def test_a_misspelt_place_or_anchor_is_offered_too(memory, typed, meant):
    answer = memory.answer(typed)
    assert answer.answer == "unsure" and answer.did_you_mean == (meant,) and answer.candidates[0].object_id == 2


@pytest.mark.parametrize(("typed", "meant"), [("find the toastre", "toaster"), ("the prniter", "printer")])
def test_a_misspelt_word_is_offered_and_never_applied(memory, typed, meant):
    answer = memory.answer(typed)
    assert answer.answer != "found" and answer.did_you_mean[0] == meant
    assert answer.understood["target"] == typed.split()[-1]


def test_a_known_word_that_is_near_a_phrase_is_no_misspelling(memory):
    assert memory.answer("the poster").did_you_mean == ()


def test_every_part_of_the_sentence_says_what_it_added(memory):
    best = memory.with_rooms([KITCHEN, OFFICE]).answer("the printer in the office next to the desk").candidates[0]
    assert set(best.terms) == {"thing", "place", "relation", "not", "which"}
    assert best.score == pytest.approx(sum(best.terms.values()))


@pytest.fixture
def chairs(site):
    """Things of which a colour or a material was said, and a bookcase of which none was."""
    site.add(["gray chair", "chair", "gray chair"], (0, 0))
    site.add(["white armchair", "armchair"], (3, 0))
    site.add(["wooden table", "table", "small table"], (6, 0), (1.0, 1.0, 0.7))
    site.add([*["brown sofa"] * 19, "red sofa"], (9, 0), (2.0, 0.8, 0.8))
    site.add("bookcase", (12, 0))
    return site.memory()


@pytest.mark.parametrize(
    ("sentence", "because"),
    [
        ("the red chair", "what fits best was called gray, never red"),
        ("a plastic table", "what fits best was called wooden, never plastic"),
        ("the large table", "what fits best was called small, never large"),
        ("take me to the red sofa", "what fits best was called brown, hardly ever red"),
        ("a red or a green chair", "never red"),
        ("the second blue chair", "never blue"),
    ],
)
def test_a_colour_size_or_material_that_the_words_of_the_map_deny_makes_it_unsure(chairs, sentence, because):
    answer = chairs.answer(sentence)
    assert answer.answer == "unsure" and because in answer.because
    assert answer.candidates[0].contradicted > 0.9


@pytest.mark.parametrize("sentence", ["the gray chair", "a grey or a red chair", "silver chair", "small wooden table"])
def test_a_colour_that_was_said_or_lies_between_is_found(chairs, sentence):
    answer = chairs.answer(sentence)
    assert (answer.answer, answer.notes, answer.candidates[0].contradicted) == ("found", (), 0.0)


def test_a_colour_of_which_nobody_spoke_is_found_and_that_is_told(chairs):
    answer = chairs.answer("the red bookcase")
    assert (answer.answer, answer.candidates[0].object_id) == ("found", 4)
    assert answer.notes == ("whether it is red was never said",)


def test_what_is_named_by_its_colour_alone_is_unsure_where_nobody_called_anything_so(chairs):
    answer = chairs.answer("something purple next to the bookcase")
    assert answer.answer == "unsure" and "called" in answer.because and "purple" in answer.because


def test_which_one_is_counted_among_those_that_the_colour_does_not_rule_out(site):
    site.add(["red chair", "chair"], (0, 0), 0.4)
    site.add(["gray chair", "chair"], (3, 0), 0.9)
    answer = site.memory().answer("the largest red chair")
    assert (answer.answer, answer.candidates[0].object_id) == ("found", 0)


def test_without_the_option_no_colour_is_doubted(chairs):
    reader = GroundedReader(lambda: chairs.reader().table, (), ENCODER.id, GroundedOptions(contradicted_at=None))
    reading = reader.read(chairs.asked("the red chair"))
    assert judge(reading, 0) == ("found", "") and not reading.contradicted.any()
