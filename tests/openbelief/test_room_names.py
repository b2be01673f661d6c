from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory
from openbelief.room_names import AHEAD, NAMES, NameScores, name_scores
from support.encoders import AxisEncoder


def scores(*things):
    """(label, look, {name: how much it tells of it}) of each thing; looks that are the same are of one kind."""
    telling = np.full((len(things), len(NAMES)), -1.0)
    for row, (_, _, tells) in enumerate(things):
        for name, amount in tells.items():
            telling[row, NAMES.index(name)] = amount
    vectors = np.eye(8)[[look for _, look, _ in things]]
    return NameScores(telling, vectors, np.ones(len(things), bool), tuple(label for label, _, _ in things))


def test_a_room_is_what_its_things_tell_of_and_says_which():
    room = scores(("bed", 0, {"bedroom": 2.0}), ("chair", 1, {"bedroom": 0.1, "office": 0.2})).name([0, 1])
    assert room.name == "bedroom" and room.because.startswith("bed, chair speak for bedroom (2.1)")


def test_things_of_one_kind_count_once_together():
    beds = [(f"bed {k}", 0, {"bedroom": 1.5}) for k in range(6)]
    desk = ("desk", 1, {"office": 2.0}), ("printer", 2, {"office": 2.0})
    assert scores(*beds, *desk).name(range(8)).name == "office"


def test_what_stands_in_rooms_of_many_kinds_names_none():
    chair = scores(("chair", 0, {"kitchen": 0.4, "office": 0.4, "dining room": 0.3}))
    room = chair.name([0])
    assert room.name is None and room.either == ("kitchen", "office") and "no name is ahead" in room.because


def test_a_long_and_narrow_room_beside_others_is_a_hallway_unless_its_things_say_more():
    things = scores(("radiator", 0, {"bathroom": 0.8, "hallway": 0.6}), ("stove", 1, {"kitchen": 6.0}))
    assert things.name([0], passage=False).name is None
    hallway = things.name([0], passage=True)
    assert hallway.name == "hallway" and "long and narrow" in hallway.because
    assert things.name([0, 1], passage=True).name == "kitchen"
    assert things.name([], passage=True).name == "hallway"
    assert things.name([], passage=False).because == "no named object stands in it"


@pytest.mark.parametrize(("lead", "named"), [(AHEAD - 0.01, None), (AHEAD + 0.01, "living room")])
def test_a_name_needs_a_lead(lead, named):
    assert scores(("rug", 0, {"living room": 0.5 + lead, "bedroom": 0.5})).name([0]).name == named


def test_one_thing_cannot_outvote_all_the_others(observe):
    """What it is told to be may be wrong: its say against a name has a bound."""
    kinds = {"stove": 0, "oven": 0, "refrigerator": 0, "bed": 1, "thing": 2}
    encoder = AxisEncoder(lambda phrase: kinds.get(phrase.split()[-1], -1), 4, "few")
    seen = [
        observe(phrase, at=(k, 0, 0.4), frame=k, look=k, dim=4) for k, phrase in enumerate(("bed", "thing", "oven"))
    ]
    told = name_scores(ObjectMemory.build(seen, encoder)).telling
    assert told.min() >= np.log(0.1) and told.max() <= np.log(0.9 * len(NAMES) + 0.1)
    thing = told[1]
    assert np.ptp(thing) == pytest.approx(0.0)  # unlike everything, it tells of nothing
