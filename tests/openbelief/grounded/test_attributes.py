"""Which words of a phrase say what a thing is like, and which of them deny each other."""

from __future__ import annotations

import pytest

from openbelief.grounded.attributes import ROWS, alternatives_of, attributes_of, denies
from openbelief.grounded.colours import SPELT
from openbelief.request.words import COLOURS, SIZES


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("red chair", {"colour": {"red"}}),
        ("small red metal chair", {"colour": {"red"}, "size": {"small"}, "material": {"metal"}}),
        ("black and white rug", {"colour": {"black", "white"}}),
        ("something red", {"colour": {"red"}}),
        ("blue one", {"colour": {"blue"}}),
        ("chair", {}),
        ("orange", {}),  # a fruit
        ("white board", {}),  # to write on, whatever its colour
        ("paper shredder", {}),
        ("gray steam iron", {"colour": {"gray"}}),
        ("table with a white cloth", {}),
        ("pair of brown shoes", {"colour": {"brown"}}),
        ("wine glass", {}),
        ("glass table", {"material": {"glass"}}),
    ],
)
def test_what_stands_before_the_name_is_an_attribute(text, said):
    assert attributes_of(text) == said


@pytest.mark.parametrize(
    ("kind", "said", "asked", "denied"),
    [
        ("colour", "gray", "red", True),
        ("colour", "grey", "gray", False),
        ("colour", "turquoise", "blue", False),
        ("colour", "green", "turquoise", False),
        ("colour", "lime", "yellow", False),
        ("colour", "white", "gray", True),
        ("size", "small", "huge", True),
        ("size", "tiny", "small", False),
        ("height", "low", "tall", True),
        ("material", "wood", "wooden", False),
        ("material", "leather", "plastic", True),
    ],
)
def test_words_of_two_rows_deny_each_other(kind, said, asked, denied):
    assert denies(kind, frozenset([said]), frozenset([asked])) is denied
    assert denies(kind, frozenset([asked]), frozenset([said])) is denied


def test_of_several_colours_one_is_enough():
    assert not denies("colour", frozenset(["black", "white"]), frozenset(["white"]))


def test_every_colour_and_size_that_the_parser_knows_stands_in_a_row():
    known = frozenset(word for rows in ROWS.values() for word in rows)
    assert known >= COLOURS | SIZES


def test_colours_that_the_score_takes_for_one_do_not_deny_each_other():
    assert not [pair for pair in SPELT.items() if denies("colour", frozenset(pair[:1]), frozenset(pair[1:]))]


def test_alternatives_share_their_noun():
    assert alternatives_of("red or blue chair") == ["red chair", "blue chair"]
    assert alternatives_of("chair or blue sofa") == ["chair", "blue sofa"]
