"""memory.rank(sentence, readout="grounded"): thing, place, relation, which one and what not, over the whole map."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory, Parameters
from openbelief.grounded.geometry import Viewer
from openbelief.grounded.options import GroundedOptions
from openbelief.rooms import Room

KITCHEN = Room("kitchen", [[0, 0], [5, 0], [5, 5], [0, 5]])
OFFICE = Room("office", [[5, 0], [10, 0], [10, 5], [5, 5]])


@pytest.fixture
def flat(site):
    """Two chairs, two lamps, a desk with one of them on it, a sofa, and things that are none of these."""
    site.add("chair", (2.5, 1))  # 0, kitchen
    site.add("chair", (7, 1))  # 1, office
    site.add("desk", (7, 2), (1.2, 0.6, 0.72))  # 2
    site.add("lamp", (7.3, 2, 0.72), 0.2)  # 3, on the desk
    site.add("lamp", (1, 4), (0.3, 0.3, 1.5))  # 4, stands in the kitchen
    site.add("sofa", (2, 4), (1.6, 0.8, 0.8))  # 5
    site.add("refrigerator", (4, 1), (0.6, 0.6, 1.7))  # 6
    site.add("guitar", (9, 4))  # 7
    return site.memory()


def test_it_ranks_as_the_other_readouts_do(flat):
    ranked = flat.rank("take me to the guitar", readout="grounded")
    assert ranked[0].object_id == 7 and len(ranked) == len(flat.objects)
    assert [c.score for c in ranked] == sorted((c.score for c in ranked), reverse=True)
    assert flat.rank("the guitar", readout="grounded", exclude={7})[0].object_id != 7
    assert len(flat.rank("the guitar", readout="grounded", limit=2)) == 2
    assert flat.retrieve("the guitar", readout="grounded").object_id == 7
    assert flat.rank(flat.asked("the guitar"), readout="grounded") == flat.rank("the guitar", readout="grounded")


def test_a_vector_ranks_every_node_by_the_things_words_alone(flat, site):
    site.add("white wall", (9, 9), (2.0, 0.1, 2.0))
    with_wall = site.memory()
    vector = with_wall.text_encoder.encode(["wall"])[0]
    assert with_wall.rank(vector, readout="grounded")[0].object_id == 8


def test_walls_are_left_out_unless_they_are_asked_for_by_name(flat, site):
    site.add("white wall", (9, 9), (2.0, 0.1, 2.0))
    memory = site.memory()
    assert 8 not in [c.object_id for c in memory.rank("the chair", readout="grounded")]
    assert memory.rank("the wall", readout="grounded")[0].object_id == 8


def test_evidence_content_hash_and_the_papers_readouts_stay_what_they_are(flat):
    before, ranked = flat.content_hash, flat.rank("the lamp on the desk")
    flat.answer("the lamp on the desk")
    assert flat.content_hash == before == flat.evidence.content_hash and flat.rank("the lamp on the desk") == ranked
    assert "grounded" not in Parameters().to_dict()


@pytest.mark.parametrize(
    ("sentence", "expected"),
    [
        ("the lamp on the desk", {3}),
        ("the desk with the lamp on it", {2}),
        ("the lamp next to the sofa", {4}),
        ("the chair nearest to the desk", {1}),
        ("the chair nearest to the refrigerator", {0}),
        ("the lamp, not the one on the desk", {4}),
        ("the lamp that is not next to the sofa", {3}),
        ("something on the desk", {3}),
        ("the lamp above the desk", {3}),
        ("something to sit on near the desk", {1}),
    ],
)
def test_a_relation_decides_among_things_of_one_name(flat, first, sentence, expected):
    assert first(flat, sentence) in expected


def test_what_stands_between_two_others_is_found(site, first):
    for x in (0, 2, 8):
        site.add("chair", (x, 0))
    site.add("sofa", (1, 0))
    site.add("table", (3, 0))
    assert first(site.memory(), "the chair between the sofa and the table") == 1


def test_left_and_in_front_are_as_the_viewer_sees_them(site, first):
    site.add("table", (3, 0), 0.5)  # 0
    site.add("chair", (3, 1))  # 1: to the left for one who looks along x
    site.add("chair", (3, -1))  # 2
    site.add("chair", (2, 0))  # 3: between the viewer and the table
    site.add("chair", (4, 0))  # 4
    memory, viewer = site.memory(), Viewer(0.0, 0.0, 0.0)
    said = {"left of": 1, "right of": 2, "in front of": 3, "behind": 4}
    assert {way: first(memory, f"the chair {way} the table", viewer=viewer) for way in said} == said


def test_given_rooms_decide_and_are_known_by_other_names(flat, first):
    memory = flat.with_rooms([KITCHEN, OFFICE])
    assert first(memory, "the chair in the office") == 1 and first(memory, "the chair in the kitchen") == 0
    assert first(memory, "the chair in the workroom") == 1
    assert first(memory, "the lamp, not in the kitchen") == 3


def test_a_room_of_any_name_is_a_place_where_the_memory_has_one(flat, first):
    memory = flat.with_rooms([Room("2.14", KITCHEN.polygon_xy), Room("lab B", OFFICE.polygon_xy)])
    assert first(memory, "the chair in 2.14") == 0 and first(memory, "the chair in lab b") == 1
    assert memory.answer("the chair in 2.14").understood["place"] == "2.14"


def test_an_object_whose_middle_lies_in_a_wall_belongs_to_the_room_beside_it(site, first):
    site.add("radiator", (5.1, 1))
    site.add("radiator", (2, 8))
    memory = site.memory().with_rooms([KITCHEN])
    assert first(memory, "the radiator in the kitchen") == 0


def test_without_rooms_a_place_is_told_from_what_stands_there(site, first):
    for k, thing in enumerate(("refrigerator", "oven", "kitchen sink", "dishwasher")):
        site.add(thing, (k, 0))
    for k, thing in enumerate(("toilet", "bathtub", "washbasin", "bath mat")):
        site.add(thing, (20 + k, 0))
    chairs = [site.add("chair", (1, 1)), site.add("chair", (21, 1))]
    memory = site.memory()
    assert first(memory, "the chair in the kitchen") == chairs[0]
    assert first(memory, "the chair in the bathroom") == chairs[1]


def test_derived_rooms_weigh_and_do_not_decide(flat, first):
    derived = [Room(r.name, r.polygon_xy, given=False, because="test") for r in (KITCHEN, OFFICE)]
    memory = flat.with_rooms(derived)
    assert first(memory, "the chair in the office") == 1
    assert first(memory, "the guitar in the kitchen") == 7  # the only guitar, whatever a derived room says


@pytest.mark.parametrize(
    ("which", "expected"),
    [("largest", 2), ("smallest", 0), ("second largest", 1), ("tallest", 1), ("biggest", 2)],
)
def test_which_one_by_its_shape(site, first, which, expected):
    for x, size in enumerate([(0.3, 0.3, 0.3), (0.3, 0.3, 1.2), (1.0, 1.0, 0.5)]):
        site.add("plant", (3.0 * x, 0), size)
    site.add("wardrobe", (9, 0), (1.5, 0.7, 2.0))
    assert first(site.memory(), f"the {which} plant") == expected


def test_only_what_stands_where_the_sentence_says_is_counted(flat):
    answer = flat.answer("the second lamp on the desk")
    assert answer.answer == "unsure" and "only 1" in answer.because and answer.candidates[0].object_id == 3


def test_ahead_and_behind_are_told_from_where_the_operator_looks(site, first):
    for x in (2, -2):
        site.add("chair", (x, 0))
    site.add("piano", (9, 9))
    memory, viewer = site.memory(), Viewer(0.0, 0.0, 0.0)
    assert first(memory, "the chair in front of me", viewer=viewer) == 0
    assert first(memory, "the chair behind me", viewer=viewer) == 1


def test_here_is_the_room_in_which_the_operator_stands(flat, first):
    memory = flat.with_rooms([KITCHEN, OFFICE])
    assert first(memory, "the chair in this room", viewer=Viewer(9.0, 1.0, 0.0)) == 1
    assert first(memory, "any chair here", viewer=Viewer(1.0, 1.0, 0.0)) == 0
    unknown = memory.answer("any chair here")
    assert unknown.answer == "unsure" and "which room you are in" in unknown.because


@pytest.mark.parametrize(
    ("sentence", "thing"),
    [
        ("where can I sit down?", "chair"),
        ("I want to sleep", "bed"),
        ("somewhere to wash my hands", "washbasin"),
        ("something to wash my hands in", "washbasin"),
        ("something to keep the milk cold", "refrigerator"),
        ("something for sitting", "chair"),
        ("where can I throw this away?", "trash can"),
        ("anything I can cook on", "stove"),
        ("a tool for cleaning", "broom"),
        ("I need to print something", "printer"),
    ],
)
def test_a_thing_is_found_by_what_it_is_for(site, sentence, thing):
    things = ["chair", "bed", "washbasin", "refrigerator", "trash can", "stove", "broom", "printer", "piano"]
    for k, name in enumerate(things):
        site.add(name, (2.0 * k, 0))
    answer = site.memory().answer(sentence)
    assert (things[answer.candidates[0].object_id], answer.answer) == (thing, "found")


def test_the_second_the_last_and_the_other_one_are_counted_from_the_best(site, first):
    for x in range(3):
        site.add("chair", (2.0 * x, 0), looks=5 - x)
    site.add("piano", (9, 0))
    memory = site.memory()
    a, b, c = (candidate.object_id for candidate in memory.answer("the chair").candidates[:3])
    said = {"the chair": a, "the second chair": b, "the third chair": c, "the last chair": c, "the other chair": b}
    assert {sentence: first(memory, sentence) for sentence in said} == said
    assert first(memory, "the other chair", exclude={b}) == c


def test_pieces_of_one_thing_are_one_when_things_are_counted(site, first):
    site.add("sofa", (0, 0), (2.0, 0.8, 0.8), name="sofa")  # 0
    memory_of_one = site.memory()
    half = memory_of_one.objects[0].points[memory_of_one.objects[0].points[:, 0] < 0.2]
    views = [*memory_of_one.observations]
    piece = views[0]
    shifted = half + np.float32([0.05, 0, 0.04])  # a fragment: half of it, seen so that association keeps it apart
    views += [type(piece)(500 + k, 0, "sofa", 0.9, shifted, piece.feature) for k in range(3)]
    site.add("sofa", (9, 0), (1.8, 0.8, 0.8))
    views += list(site.memory().objects[1].observations)
    memory = ObjectMemory.build(views, memory_of_one.text_encoder, Parameters(tau_g=0.99))
    assert len(memory.objects) == 3
    best, second = (first(memory, s) for s in ("the sofa", "the second sofa"))
    far = next(node.id for node in memory.objects if node.centroid[0] > 5)
    assert {best == far, second == far} == {True, False}


def test_nearest_and_left_are_told_from_where_the_operator_stands(site, first):
    for x, y in ((1, 3), (1, -3), (6, 0)):
        site.add("chair", (x, y))
    site.add("piano", (9, 9))
    memory = site.memory()
    assert first(memory, "the nearest chair", viewer=Viewer(5.0, 0.0, 0.0)) == 2
    assert first(memory, "the chair nearest to me", viewer=Viewer(1.0, 2.0, 0.0)) == 0
    assert first(memory, "the chair on the left", viewer=Viewer(0.0, 0.0, 0.0)) == 0
    assert first(memory, "the chair on the right", viewer=Viewer(0.0, 0.0, 0.0)) == 1
    unknown = memory.answer("the nearest chair")
    assert unknown.understood["unused"] == ["nearest"] and "where you are" in unknown.notes[0]


def test_a_colour_is_told_from_what_was_said_of_each(site, first):
    site.add(["chair", "red chair", "chair"], (0, 0))
    site.add(["chair", "blue chair", "chair"], (3, 0))
    site.add(["chair", "chair", "chair", "chair"], (6, 0))
    memory = site.memory()
    assert first(memory, "the red chair") == 0 and first(memory, "the blue chair") == 1
    assert first(memory, "a chair, but not the red one") in {1, 2}


def test_a_colour_in_front_of_a_name_does_not_make_it_another_thing(site, first):
    site.add(["blue tv", "tv", "grey tv"], (0, 0))
    site.add("toaster", (3, 0))
    answer = site.memory().answer("the television")
    assert answer.answer == "found" and answer.candidates[0].object_id == 0


def test_what_means_the_same_is_found_and_what_is_known_to_be_other_is_not(site, first):
    site.add("armchair", (0, 0))
    site.add("folding chair", (3, 0))
    site.add("bookshelf", (6, 0))
    site.add("book", (9, 0))
    memory = site.memory()
    assert first(memory, "the comfy chair") == 0 and first(memory, "the novel") == 3
    assert first(memory, "something to read") == 3


def test_a_negation_rules_out_what_is_more_that_than_the_thing(site, first):
    site.add("armchair", (0, 0), looks=9)
    site.add("wooden chair", (3, 0))
    assert first(site.memory(), "a chair, not the armchair") == 1


def test_where_features_are_no_text_language_ranks_alone(site, first):
    site.add("chair", (0, 0))
    site.add("table", (3, 0))
    memory = site.memory(feature_text_aligned=False)
    ranked = memory.rank("the table", readout="grounded")
    assert ranked[0].object_id == 1 and ranked[0].visual is None


def test_a_thing_that_was_never_named_is_ranked_by_what_it_looks_like(site):
    site.add("chair", (0, 0))
    views = [*site.memory().observations]
    encoder = site.memory().text_encoder
    away, globe = views[0].points + np.float32([5, 0, 0]), encoder.encode(["globe"])[0]
    views += [type(views[0])(900 + k, 0, None, 0.9, away, globe) for k in range(3)]
    memory = ObjectMemory.build(views, encoder)
    assert {c.object_id for c in memory.rank("the globe", readout="grounded")} == {0, 1}
    assert memory.rank("the globe", readout="grounded")[0].object_id == 1


def test_an_empty_memory_has_no_candidates(site):
    memory = site.memory()
    for sentence in ("the chair", "the chair in the kitchen", "the nearest chair in the kitchen or the office"):
        assert memory.rank(sentence, readout="grounded") == []
        assert memory.answer(sentence).answer == "not found"


def test_looks_may_count_moments_in_time(site):
    from openbelief.grounded.looks import moments
    from openbelief.observation import Observation, Provenance

    rle = {"size": [1, 1], "counts": [0, 1]}
    point, feature = np.zeros((1, 3), np.float32), np.eye(4, dtype=np.float32)[0]
    stamps_ms = (0, 33, 67, 700, 1400)
    views = [
        Observation(k, 0, "cup", 0.9, point, feature, Provenance("walk", ms * 1_000_000, (0, 0, 1, 1), rle))
        for k, ms in enumerate(stamps_ms)
    ]
    assert moments(views, 0.5) == 3  # the first three frames lie within 67 ms: one look
    assert moments(views, 0.01) == 5


def test_the_way_of_counting_looks_is_an_option_of_the_readout(site):
    site.add("chair", (0, 0), looks=4)
    memory = site.memory()
    for looks in ("observations", "frames", "moments"):
        assert memory.reader(GroundedOptions(looks=looks)).table.looks.tolist() == [4.0]


@pytest.mark.parametrize("value", [{"temperature": 0.0}, {"looks": "once"}, {"fit_margin": 2.0}, {"unknown": 1}])
def test_an_option_out_of_range_is_refused_by_name(value):
    with pytest.raises(ValueError, match=next(iter(value))):
        GroundedOptions(**value)
