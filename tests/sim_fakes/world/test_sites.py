"""Random furnished sites: drawn from the seed alone, true in themselves, and foreign to the development recordings."""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from openbelief.evaluation.truth import truth_of
from openbelief.perception.sentence import SentenceEncoder
from openbelief.room_regions import room_regions
from openbelief.traversability import OCCUPIED, reach
from sim_fakes.world.sites.catalogue import ROOMS, marks, things
from sim_fakes.world.sites.layout import COLOURS, furnished
from sim_fakes.world.sites.plan import site_map
from sim_fakes.world.sites.questions import COUNTS, Questions, unsaid_names
from sim_fakes.world.sites.site import Site, make_site

RECORDINGS = Path(__file__).resolve().parents[4] / "shared" / "recordings"


@pytest.fixture(scope="module")
def site() -> Site:
    return make_site(3, SentenceEncoder())


def test_things_stand_in_their_rooms_and_in_no_other_thing():
    for seed in range(4):
        rooms, placed = furnished(seed)
        boxes = {room.name: room for room in rooms}
        for p in placed:
            room = boxes[p.room]
            assert (
                room.x0 <= p.aabb[0, 0] < p.aabb[1, 0] <= room.x1 and room.y0 <= p.aabb[0, 1] < p.aabb[1, 1] <= room.y1
            )
        for a, b in combinations(placed, 2):
            assert not ((a.aabb[0] < b.aabb[1] - 1e-9) & (b.aabb[0] < a.aabb[1] - 1e-9)).all(), (a.label, b.label)


def test_a_site_follows_from_its_seed_alone(site):
    again, other = make_site(3, SentenceEncoder()), furnished(4)[1]
    assert again.memory.content_hash == site.memory.content_hash and again.truth == site.truth
    assert [o["aabb"] for o in site.truth["objects"]] != [p.aabb.tolist() for p in other]


def test_its_truth_is_read_as_any_other_and_every_query_has_an_answer(site):
    truth, relations = truth_of(site.truth), truth_of(site.relations)
    assert {q.kind for q in truth.queries} == set(COUNTS) and all(q.accept for q in truth.queries)
    assert relations.queries and all(q.accept for q in relations.queries)
    for query in truth.queries:
        if query.kind == "room":
            place = query.query.rstrip("?").removesuffix(", please").partition(" in the ")[2]
            rooms = {o["room"] for o in site.truth["objects"] if o["id"] in query.accept}
            assert rooms == {place}


def test_the_name_that_only_an_operator_uses_is_never_said(site):
    placed = furnished(3)[1]
    unsaid = unsaid_names(placed, np.random.default_rng([3, 0xA5C]))
    of_label = {p.id: p.label for p in placed}
    origin = {(stamp, mask): true_id for stamp, mask, true_id in site.truth["mask_origin"]}
    for o in site.memory.observations:
        true_id = origin.get((o.provenance.stamp_ns, o.mask))
        if true_id is not None and (name := unsaid.get(of_label[true_id])):
            assert o.phrase not in {name, *(f"{colour} {name}" for colour in COLOURS)}
    assert unsaid


def test_its_map_shows_walls_with_a_door_to_every_room():
    rooms, placed = furnished(3)
    bare, grid = site_map(rooms, []), site_map(rooms, placed)
    assert room_regions(bare, []).count == len(rooms)
    way = reach(bare, np.array([rooms[-1].x0 + 0.5, (rooms[-1].y0 + rooms[-1].y1) / 2]))
    for room in rooms:
        middle = np.array([(room.x0 + room.x1) / 2, (room.y0 + room.y1) / 2])
        assert np.isfinite(way.distance_m[tuple(bare.cell(middle))])
    assert all(grid.at(p.aabb.mean(axis=0)[:2]) == OCCUPIED for p in placed if p.on is None)


def test_what_is_called_absent_is_called_nothing_here():
    placed = furnished(3)[1]
    absent = Questions(placed, {}, np.random.default_rng(0)).absent()
    here = {word for p in placed for word in p.thing.words}
    assert len(absent) > 50 and here.isdisjoint(absent)


def test_nothing_that_is_asked_for_is_a_label_of_the_development_recording():
    if not (RECORDINGS / "apartment.truth.json").exists():
        pytest.skip("apartment.truth.json is not in ../shared/recordings")
    labels = {o["label"] for o in json.loads((RECORDINGS / "apartment.truth.json").read_text())["objects"]}
    assert labels.isdisjoint(things())


def test_every_room_has_the_pieces_by_which_people_know_it():
    assert {room for mark in marks() for room in mark.rooms} == set(ROOMS.values())
