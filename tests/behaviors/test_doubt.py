"""What the map may not hold: not found drives nowhere, unsure asks a person, and a person may insist."""

from __future__ import annotations

import dataclasses

import pytest

from drivers.ports import Approval, Reply
from logs.trial.records import Ranking
from openbelief.grounded.options import GroundedOptions
from robot_app.mission.replay import GROUNDED_BEFORE

NO = Reply(Approval.NO)


@pytest.fixture
def room(stage, make):
    def make_stage(**policy):
        made = stage([make.box(3.0, 1.5, "potted plant", "potted plant"), make.box(5.0, 5.0, "guitar", "guitar")])
        made.policy = dataclasses.replace(made.policy, readout="grounded", **policy)
        return made

    return make_stage


def test_what_is_there_is_driven_to_and_confirmed(room):
    stage = room()
    assert stage.run("take me to the guitar").end == "CONFIRMED"
    [ranking] = stage.of(Ranking)
    assert (ranking.readout, ranking.answer, ranking.understood["target"]) == ("grounded", "found", "guitar")
    assert set(ranking.terms[0]) == {"thing", "place", "relation", "not", "which"}


@pytest.mark.parametrize("motion", ["ask", "allow"])
def test_what_is_not_found_is_driven_to_by_nobody_and_the_nearest_are_told(room, motion):
    stage = room(motion=motion)
    outcome = stage.run("take me to the saxophone")
    assert (outcome.end, outcome.reason, outcome.visits) == ("FAILED", "not found", 0)
    assert stage.sent == [] and stage.asked == []
    assert any("the nearest are" in told for told in stage.told)


def test_a_person_may_insist(room):
    stage = room(doubt="insist")
    stage.run("take me to the saxophone")
    assert stage.sent and any("you insist" in told for told in stage.told)


def test_unsure_asks_a_person_and_says_why(room):
    stage = room()
    stage.replies = [NO]
    assert stage.run("the guitar next to the aquarium").end == "CANCELLED"
    assert "I am not sure" in stage.asked[0] and "aquarium" in stage.asked[0]
    assert stage.sent == []
    again = room()
    assert again.run("the guitar next to the aquarium").end == "CONFIRMED"


def test_a_trial_that_was_recorded_before_colours_were_doubted_replays_without_doubting_them():
    assert GroundedOptions.from_dict(GROUNDED_BEFORE).contradicted_at is None
    assert GroundedOptions.from_dict(GROUNDED_BEFORE | GroundedOptions().to_dict()) == GroundedOptions()


@pytest.mark.parametrize("policy", [{"motion": "allow"}, {"doubt": "refuse"}])
def test_unsure_drives_nowhere_where_nobody_is_asked(room, policy):
    stage = room(**policy)
    outcome = stage.run("the guitar next to the aquarium")
    assert (outcome.end, outcome.visits, stage.sent) == ("FAILED", 0, []) and outcome.reason.startswith("unsure: ")


def test_the_nearest_is_told_from_where_the_robot_stands(stage, make):
    near, far = make.box(2.5, 1.0, "guitar", "guitar"), make.box(6.0, 6.0, "guitar", "guitar")
    made = stage([far, near, make.box(5.0, 2.0, "sofa", "sofa")])
    made.policy = dataclasses.replace(made.policy, readout="grounded")
    outcome = made.run("the nearest guitar")
    assert outcome.end == "CONFIRMED" and made.memory.objects[outcome.object_id].centroid[0] < 4


def test_the_other_one_is_of_what_was_asked_for_before(stage, make):
    def guitars():
        made = stage([make.box(2.5, 1.0, "guitar", "guitar"), make.box(6.0, 6.0, "guitar", "guitar")])
        made.policy = dataclasses.replace(made.policy, readout="grounded")
        return made

    first, again = guitars().run("take me to the guitar"), guitars()
    other = again.run("the other one", after="take me to the guitar")
    assert (first.end, other.end) == ("CONFIRMED", "CONFIRMED") and first.object_id != other.object_id
    [ranking] = again.of(Ranking)
    assert (ranking.understood["target"], ranking.understood["which"]) == ("guitar", "other")


def test_the_papers_readouts_know_no_doubt(room):
    stage = room()
    stage.policy = dataclasses.replace(stage.policy, readout="consensus")
    stage.run("take me to the saxophone")
    assert stage.sent and stage.of(Ranking)[0].answer is None
