"""Rooms that are said in German, Spanish, French or Italian; English sentences stay as they are."""

from __future__ import annotations

import pytest

from openbelief.request import parse
from openbelief.request.other_languages import LANGUAGES, in_english, kind_abroad
from openbelief.request.places import PLACES

PLACED = [
    ("Wo ist der Stuhl in der Küche?", "stuhl", "kitchen"),
    ("der Stuhl in der Kueche", "stuhl", "kitchen"),
    ("zeig mir die Lampe im Schlafzimmer, bitte", "lampe", "bedroom"),
    ("Im Flur, der Schirm", "schirm", "hallway"),
    ("der Stuhl im Wohnzimmer neben dem Tisch", "stuhl neben dem tisch", "living room"),
    ("¿Dónde está la lámpara en el dormitorio?", "lámpara", "bedroom"),
    ("busca el espejo en el cuarto de baño", "espejo", "bathroom"),
    ("la silla roja en mi cocina, por favor", "silla roja", "kitchen"),
    ("le tapis dans l'entrée", "tapis", "entrance"),
    ("où est le miroir dans la salle de bain", "miroir", "bathroom"),
    ("l'ordinateur dans le bureau", "l'ordinateur", "office"),
    ("il tappeto nell'ingresso", "tappeto", "entrance"),
    ("la sedia in cucina", "sedia", "kitchen"),
]


@pytest.mark.parametrize(("sentence", "target", "place"), PLACED)
def test_a_room_of_another_language_is_a_place(sentence, target, place):
    request = parse(sentence)
    assert (request.target, request.place, request.unused) == (target, place, ())
    assert request.sentence == sentence


@pytest.mark.parametrize(
    "sentence", ["der Stuhl, nicht in der Küche", "la sedia, non in cucina", "la chaise qui n'est pas dans la cuisine"]
)
def test_a_room_where_it_is_not_is_no_place_to_look(sentence):
    request = parse(sentence)
    assert request.place is None and [negation.place for negation in request.negations] == ["kitchen"]


@pytest.mark.parametrize("sentence", ["kein Stuhl in der Küche", "la silla que no está en la cocina"])
def test_where_it_cannot_be_told_what_is_refused_no_place_is_read(sentence):
    assert parse(sentence).place is None


@pytest.mark.parametrize("sentence", ["Geh in die Küche", "va dans la cuisine", "vai nella cucina"])
def test_a_room_alone_is_asked_for_itself(sentence):
    assert parse(sentence).target == "kitchen"


@pytest.mark.parametrize(
    "words",
    [
        "the papers in the bureau",
        "the vase in the salon",
        "the lamp in the camera",
        "im bad at this",
        "no chair in the kitchen",
        "die tasse im schrank",
    ],
)
def test_what_is_no_room_behind_a_preposition_of_its_language_stays_as_it_was_said(words):
    assert in_english(words) == words


def test_every_kind_is_one_that_the_places_know_and_no_name_is_of_two():
    kinds = {row[0] for row in PLACES}
    for _, rooms in LANGUAGES.values():
        names = [name for row in rooms.values() for name in row.split(", ")]
        assert rooms.keys() <= kinds and len(names) == len(set(names))


def test_a_room_may_bear_such_a_name():
    assert (kind_abroad("küche"), kind_abroad("wohnzimmer"), kind_abroad("kitchen")) == ("kitchen", "living room", None)
