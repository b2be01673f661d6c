"""What is seen on arrival, added to a copy of the candidate: is it still the answer?"""

from __future__ import annotations

import numpy as np
import pytest

from openbelief.arrays import normalize
from openbelief.grounded.arrival import RelativeCheck, SeenThere, name_of, relative_check
from openbelief.memory import ObjectMemory


@pytest.fixture
def memory(site):
    """Umbrella stand first: from afar it was called a fire extinguisher; the true one a hydrant."""
    site.add("fire extinguisher", (0, 0), name="umbrella stand", looks=2)
    site.add(["fire hydrant", "red bottle"], (4, 0), name="fire extinguisher")
    site.add("shoe cabinet", (8, 0))
    site.add("umbrella holder", (8, 3), looks=4)
    site.add(["armchair", "chair"], (8, 6))
    return site.memory()


def seen(memory: ObjectMemory, phrase: str | None, name: str | None = None) -> SeenThere:
    """name: what its feature is of, its phrase by default; None with no phrase is no feature."""
    text = name or phrase
    vector = None if text is None else normalize(memory.text_encoder.encode([text])[0]).astype(np.float32)
    return SeenThere(phrase, 20.0, vector)


def checked(memory: ObjectMemory, sentence: str, candidate: int, *looks, excluded=frozenset()) -> RelativeCheck:
    asked, reader = memory.asked(sentence), memory.reader()
    return relative_check(reader, reader.read(asked), asked, candidate, looks, frozenset(excluded))


def test_what_is_seen_as_asked_keeps_the_candidate_the_answer(memory):
    check = checked(memory, "fire extinguisher", 0, [seen(memory, "fire extinguisher")])
    assert check.likeness > 0.9 and check.lead > 0 and check.naming.contrast > 0
    assert check.naming.asked_like == pytest.approx(1.0)


def test_another_name_from_near_lowers_likeness_and_lead_and_says_what_it_looks_like(memory):
    as_asked = checked(memory, "fire extinguisher", 0, [seen(memory, "fire extinguisher")])
    other = checked(memory, "fire extinguisher", 0, [seen(memory, "umbrella stand")])
    assert other.likeness < as_asked.likeness and other.lead < as_asked.lead and other.naming.contrast < 0
    assert (other.naming.called, other.naming.looks_like) == ("umbrella stand", "umbrella stand")
    assert other.naming.rival_like == pytest.approx(1.0) and other.naming.asked_like < 0.55


def test_of_all_that_meets_the_place_the_mask_most_like_the_words_counts(memory):
    beside = [seen(memory, "shoe cabinet"), seen(memory, "fire extinguisher"), seen(memory, "armchair")]
    alone = checked(memory, "fire extinguisher", 0, [beside[1]])
    assert checked(memory, "fire extinguisher", 0, beside) == alone


def test_both_looks_count(memory):
    doubt, sure = [seen(memory, "umbrella stand")], [seen(memory, "fire extinguisher")]
    both = checked(memory, "fire extinguisher", 0, doubt, sure)
    assert both.naming.called == "fire extinguisher"
    assert checked(memory, "fire extinguisher", 0, doubt).likeness < both.likeness
    assert checked(memory, "fire extinguisher", 0, (), sure) == checked(memory, "fire extinguisher", 0, sure)
    with pytest.raises(ValueError, match="Nothing was seen"):
        checked(memory, "fire extinguisher", 0, (), ())


def test_what_was_ruled_out_is_no_rival(memory):
    look = [seen(memory, "umbrella stand")]
    check = checked(memory, "umbrella stand", 0, look)
    assert check.rival == 3
    again = checked(memory, "umbrella stand", 0, look, excluded={3})
    assert again.rival != 3 and again.lead > check.lead
    alone = checked(memory, "umbrella stand", 0, look, excluded={1, 2, 3, 4})
    assert alone.rival is None and alone.lead == np.inf


def test_the_others_of_a_kind_are_no_rivals_where_the_sentence_counts_them(site):
    for x in (0, 3, 6):
        site.add("chair", (x, 0), looks=3 + x)
    site.add("table", (9, 0))
    memory = site.memory()
    best, second = (memory.answer(f"the {which} chair").candidates[0].object_id for which in ("first", "second"))
    check = checked(memory, "the second chair", second, [seen(memory, "chair")])
    assert check.rival == 3 and check.lead > 0 and best != second


def test_a_sentence_that_names_no_thing_is_answered_by_where_it_stands(site):
    site.add("table", (0, 0), (1.0, 1.0, 0.7))
    site.add("vase", (0, 0, 0.7), 0.2)
    site.add("book", (5, 0), 0.2)
    check = checked(site.memory(), "something on the table", 1, [seen(site.memory(), "flower vase")])
    assert check.likeness == 1.0 and check.lead > 0


def test_without_a_feature_the_names_decide_alone(memory):
    with_words = name_of(memory.reader(), memory.asked("sofa"), "sofa", seen(memory, "armchair"))
    blind = name_of(memory.reader(), memory.asked("sofa"), "sofa", SeenThere("armchair", 20.0, None))
    assert blind.asked_like == with_words.asked_like and blind.contrast != with_words.contrast
    unnamed = checked(memory, "fire extinguisher", 0, [seen(memory, None, "fire extinguisher")])
    assert unnamed.naming.called is None and unnamed.naming.asked_like == 0.0
    assert unnamed.likeness == pytest.approx(checked_by_map(memory), abs=0.2)


def checked_by_map(memory: ObjectMemory) -> float:
    return float(memory.reader().read(memory.asked("fire extinguisher")).head[0])


def test_the_memory_is_not_changed(memory):
    before = memory.fingerprint()
    ranking = memory.rank("fire extinguisher", "grounded")
    checked(memory, "fire extinguisher", 0, [seen(memory, "umbrella stand")])
    assert memory.fingerprint() == before and memory.rank("fire extinguisher", "grounded") == ranking
