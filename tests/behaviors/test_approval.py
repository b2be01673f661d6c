"""Nothing moves without a yes for this candidate, and what the operator answers is done and kept."""

from __future__ import annotations

import pytest

from behaviors.events import End
from drivers.ports import Approval, Reply
from logs.trial import records


@pytest.mark.parametrize("answer", ["no", "expired", "allow", "set aside"])
def test_what_no_pose_can_see_is_set_aside_and_the_operator_told(stage, make, answer):
    s = stage([make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher", z=1.6)])
    policies = {"allow": {"motion": "allow"}, "set aside": {"unseen": "set aside"}}
    s.policy, s.replies = type(s.policy)(**policies.get(answer, {})), [answer]
    outcome = s.run()
    assert len(s.asked) == (answer not in policies) and s.sent == []
    assert outcome.end is End.NAVIGATION_FAILED and outcome.set_aside == (0,)
    goal, *_ = s.of(records.Goal)
    assert goal.pose is None and "see" in goal.reason
    assert goal.reason in s.told[0]


def test_a_person_may_send_the_robot_to_what_no_pose_can_see(stage, make):
    s = stage([make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher", z=1.6)])
    s.replies = ["yes"]
    outcome = s.run()
    assert "No pose can see it" in s.asked[0] and "all the same?" in s.asked[0]
    assert len(s.sent) >= 1 and (outcome.end, outcome.rejected) == (End.FAILED, (0,))
    assert s.of(records.Checks)[0].verdict == "insufficient visibility"


def test_stop_instead_of_an_answer_stays_a_stop(stage, make):
    s = stage([make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher", z=1.6)])
    s.replies = ["stop"]
    assert s.run().end is End.CANCELLED


@pytest.mark.parametrize("reply", ["no", "expired"])
def test_nothing_moves_without_a_yes(stage, extinguisher, reply):
    s = stage([extinguisher])
    s.replies = [reply]
    assert s.run().end is End.CANCELLED
    assert s.sent == []


def test_a_site_may_allow_motion_without_asking(stage, extinguisher):
    s = stage([extinguisher])
    s.policy = type(s.policy)(motion="allow")
    assert s.run().end is End.CONFIRMED
    assert s.asked == [] and any(told.startswith("I walk to the fire extinguisher") for told in s.told)


def test_a_question_is_bound_to_the_object_its_goal_the_way_and_the_memory(stage, impostor, extinguisher):
    s = stage([impostor, extinguisher])
    s.replies = ["no"]
    s.run()
    [question] = s.questions
    assert question.memory_hash == s.memory.state_hash
    assert question.object_id == s.of(records.Chosen)[0].object_id == question.options[0].object_id
    assert question.path_length_m == pytest.approx(question.goal.distance_to(s.robot))
    assert [option.number for option in question.options] == list(range(1, len(question.options) + 1))
    assert "Seen 3 times in 3 frames, called fire extinguisher" in question.because
    [asked] = s.of(records.Asked)
    assert (asked.object_id, asked.memory_hash) == (question.object_id, question.memory_hash)


def test_who_answered_how_and_when_is_in_the_trial(stage, extinguisher):
    s = stage([extinguisher])
    s.run()
    [reply] = s.of(records.OperatorReply)
    assert (reply.reply, reply.who, reply.how, reply.at_ns) == ("yes", "Ada", "stage", 7)


def test_not_this_one_is_set_aside_as_declined_and_the_next_one_is_asked_for(stage, impostor, extinguisher):
    s = stage([impostor, extinguisher])
    s.replies = ["not this one"]
    outcome = s.run()
    first = s.questions[0].object_id
    assert outcome.end is End.CONFIRMED or outcome.object_id != first
    assert outcome.declined == outcome.set_aside == (first,) and first not in outcome.rejected
    [exclusion] = [e for e in s.of(records.Exclusion) if e.object_id == first]
    assert (exclusion.where, exclusion.declined) == ("set aside", True)
    assert s.questions[1].object_id != first


def test_declined_candidates_are_outside_the_limit_of_three(stage, make):
    s = stage([make.box(2.0 + k, 5.0, "fire extinguisher", "fire extinguisher") for k in range(5)])
    s.replies = ["not this one"] * 4
    outcome = s.run()
    assert outcome.end is End.CONFIRMED and len(outcome.declined) == 4


def test_where_the_operator_wants_none_of_them_the_mission_is_cancelled(stage, impostor, extinguisher):
    s = stage([impostor, extinguisher])
    s.replies = ["not this one", "not this one"]
    outcome = s.run()
    assert (outcome.end, outcome.visits, s.sent) == (End.CANCELLED, 0, [])
    assert outcome.reason == "no candidate left that the operator wants"


def test_another_candidate_may_be_taken_first_and_is_asked_for_itself(stage, impostor, extinguisher):
    s = stage([impostor, extinguisher])
    first, second = (each.object_id for each in s.memory.rank("fire extinguisher", limit=2))
    s.replies = [Reply(Approval.TAKE, second), "yes"]
    outcome = s.run()
    assert [question.object_id for question in s.questions[:2]] == [first, second]
    assert s.of(records.Chosen)[1].object_id == second
    assert s.path[:4] == ["retrieve", "await_approval", "retrieve", "await_approval"]
    assert outcome.end is End.CONFIRMED


def test_a_candidate_that_is_not_asked_about_may_be_excluded_by_hand(stage, impostor, extinguisher):
    s = stage([impostor, extinguisher])
    first, second = (each.object_id for each in s.memory.rank("fire extinguisher", limit=2))
    s.replies = [Reply(Approval.NOT_THIS_ONE, second)]
    outcome = s.run()
    assert outcome.declined == (second,)
    assert [question.object_id for question in s.questions] == [first, first]
