"""What may be asked of a memory, and which of its nodes may answer."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory, Parameters
from support.encoders import AxisEncoder


def synonyms() -> AxisEncoder:
    """Knows that a couch is a sofa, and nothing else."""
    return AxisEncoder(lambda text: 1 if text in ("sofa", "couch") else 2, 3, "synonyms")


def test_a_sentence_finds_the_thing_it_names(memory):
    assert memory.rank("take me to the floor lamp, please?")[0].object_id == 2


def test_a_sentence_ranks_no_background_unless_it_asks_for_it(memory, tiny_encoder):
    assert {c.object_id for c in memory.rank("lamp")} == {0, 1, 2}
    assert memory.rank("the white wall")[0].object_id == 3
    assert {c.object_id for c in memory.rank(np.ones(16))} == {0, 1, 2, 3}


def test_background_is_asked_for_by_name_and_not_by_the_place_of_something_else(memory):
    for asked in ("the wall in the kitchen", "white wall", "the wall behind the lamp"):
        assert 3 in {c.object_id for c in memory.rank(asked)}, asked
    for asked in ("a lamp on the wall", "chair by the wall"):
        assert 3 not in {c.object_id for c in memory.rank(asked)}, asked


def test_the_heaviest_phrase_makes_background_whichever_concept_is_heaviest(observe):
    said = ["wall"] * 5 + ["sofa"] * 4 + ["couch"] * 4
    views = [observe(phrase, frame=frame, dim=3) for frame, phrase in enumerate(said)]
    (node,) = ObjectMemory.build(views, synonyms()).objects
    assert (node.label, node.heaviest_phrase, node.background) == ("couch", "wall", True)
    (node,) = ObjectMemory.build(views[1:], synonyms(), Parameters(weight="uniform")).objects
    assert (node.label, node.heaviest_phrase, node.background) == (
        "couch",
        "couch",
        False,
    )  # a tie goes to the alphabet


def test_floor_lamps_are_no_floor(observe, tiny_encoder):
    memory = ObjectMemory.build([observe("floor lamp"), observe("door mat", at=(2, 0, 0), mask=1)], tiny_encoder)
    assert not any(node.background for node in memory.objects)


def test_an_empty_memory_gives_none_and_says_why(tiny_encoder):
    memory = ObjectMemory.build([], tiny_encoder)
    assert memory.objects == () and memory.retrieve("lamp") is None and memory.retrieve(np.ones(16)) is None
    assert memory.nothing_because("lamp") == "the memory holds no objects"
    assert memory.project(["lamp", "box"]).shape == (0, 2)


def test_nothing_left_says_why(memory, observe, tiny_encoder):
    assert memory.nothing_because("lamp") is None
    assert memory.nothing_because("lamp", exclude={0, 1, 2}) == "all 3 candidates are excluded"
    walls = ObjectMemory.build([observe("wall")], tiny_encoder)
    assert walls.retrieve("lamp") is None and "background" in walls.nothing_because("lamp")


def test_an_empty_memory_needs_no_encoder_to_say_that_it_holds_nothing(tiny_encoder, tmp_path):
    ObjectMemory.build([], tiny_encoder).save(tmp_path / "empty.belief")
    memory = ObjectMemory.open(tmp_path / "empty.belief")
    assert memory.retrieve("lamp") is None and memory.rank("lamp") == []
    assert memory.nothing_because("lamp") == "the memory holds no objects"
    with pytest.raises(ValueError, match="names nothing"):
        memory.rank(" ")


@pytest.mark.parametrize("query", [None, 5, [1, [2]], b"red chair", ["red", "chair"], np.ones((2, 16))])
def test_what_is_neither_a_sentence_nor_a_vector_is_refused_as_that(memory, query):
    with pytest.raises(ValueError, match=r"^The query should be a sentence or a \(d,\) vector, got \w+\.$"):
        memory.rank(query)


@pytest.mark.parametrize("limit", [-1, 2.5, "3"])
def test_a_limit_that_is_none_is_refused(memory, limit):
    with pytest.raises(ValueError, match="limit"):
        memory.rank("lamp", limit=limit)


@pytest.mark.parametrize("query", [np.full(16, np.nan), np.zeros(16), np.ones(15), np.ones((2, 16)), "", " ?! ", "the"])
def test_a_query_that_asks_nothing_is_refused(memory, query):
    with pytest.raises(ValueError, match=r"\S"):
        memory.rank(query)
