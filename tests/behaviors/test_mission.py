"""Stories of Algorithm 1. `stage.run` also replays every one of them and fails where a decision differs."""

from __future__ import annotations

import dataclasses
import sys

import numpy as np
import pytest

from behaviors.events import End
from behaviors.mission import Mission
from drivers.ports import Approval, Interrupted, NavigationResult, NavigationStatus, PoseUnavailable, Reply
from logs.trial import records
from openbelief.perception.ports import FrameUnseen, PerceptionFailed
from openbelief.perception.sentence import SentenceEncoder
from openbelief.pose import Pose2
from openbelief.target_phrase import target_phrase

ABORTED = NavigationResult(NavigationStatus.ABORTED, "no valid path", 208)
SENTENCE = "take me to the fire extinguisher"


@pytest.fixture
def extinguisher(make):
    return make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher")


@pytest.fixture
def impostor(make):
    """The same words on the map, a vase up close; mapped first, so that it is tried first."""
    return make.box(2.5, 5.0, "fire extinguisher", "blue vase")


def test_the_right_candidate_is_confirmed_at_the_first_visit(stage, extinguisher):
    s = stage([extinguisher])
    outcome = s.run()
    assert (outcome.end, outcome.visits, outcome.object_id) == (End.CONFIRMED, 1, 0)
    assert s.path == ["retrieve", "await_approval", "navigate", "verify", "confirmed"]
    assert len(s.asked) == 1 and "fire extinguisher" in s.asked[0]


def test_an_impostor_is_rejected_and_the_next_candidate_confirmed(stage, impostor, extinguisher):
    s = stage([impostor, extinguisher])
    outcome = s.run()
    assert (outcome.end, outcome.visits, outcome.object_id, outcome.rejected) == (End.CONFIRMED, 2, 1, (0,))
    assert [c.verdict for c in s.of(records.Checks)] == ["no matching mask", "confirmed"]
    assert any("not confirmed" in sentence for sentence in s.told)


@pytest.mark.parametrize("readout", ["consensus", "grounded"])
def test_a_sentence_is_parsed_once_and_each_word_encoded_once(stage, make, impostor, readout, monkeypatch):
    """Through two rankings and two arrivals; the words of their masks are others, and are encoded too."""
    s = stage([impostor, make.box(5.0, 2.0, "fire extinguisher", "red fire extinguisher")])
    s.policy = dataclasses.replace(s.policy, readout=readout)
    encoded, parsed = [], []

    class CountingEncoder(SentenceEncoder):
        def encode(self, texts):
            encoded.extend(texts)
            return super().encode(texts)

    def counted(sentence):
        parsed.append(sentence)
        return target_phrase(sentence)

    for module in (sys.modules["openbelief.memory"], sys.modules["openbelief.request.parse"]):
        monkeypatch.setattr(module, "target_phrase", counted)
    s.memory = dataclasses.replace(s.memory, text_encoder=CountingEncoder())
    assert Mission(s.ports, s.memory, s.parameters, s.policy, s.journal).run(SENTENCE).visits == 2
    assert parsed == [SENTENCE]
    assert encoded.count("fire extinguisher") == 1 and len(encoded) == len(set(encoded))


def test_a_rejected_candidate_never_comes_back(stage, impostor, extinguisher):
    s = stage([impostor, extinguisher])
    s.run()
    first, second = s.of(records.Ranking)
    assert first.candidates[0].object_id == 0
    assert second.rejected == (0,) and 0 not in [c.object_id for c in second.candidates]


def test_top_1_only_stops_after_one_rejection(stage, impostor, extinguisher):
    outcome = stage([impostor, extinguisher], k_max=1).run()
    assert (outcome.end, outcome.reason, outcome.visits) == (End.FAILED, "attempt budget reached", 1)


def test_no_candidate_left_is_a_failure_of_the_search(stage, impostor):
    outcome = stage([impostor]).run()
    assert (outcome.end, outcome.reason, outcome.visits) == (End.FAILED, "no candidate left", 1)


def test_an_empty_memory_ends_at_once_and_says_so(stage, make):
    s = stage([make.box(5.0, 2.0, None, "fire extinguisher")])
    outcome = s.run()
    assert outcome.end is End.NAVIGATION_FAILED and "holds no objects" in outcome.reason
    assert s.sent == []


def test_an_unreached_candidate_is_tried_from_its_next_best_pose(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(end=ABORTED)]
    outcome = s.run()
    assert (outcome.end, outcome.visits) == (End.CONFIRMED, 1)
    assert len(s.sent) == 2 and s.sent[0].distance_to(s.sent[1]) >= 0.5
    assert len(s.asked) == 1  # the operator's yes was for the candidate


def test_navigation_failure_is_not_evidence_and_costs_no_attempt(stage, impostor, extinguisher, make):
    s = stage([impostor, extinguisher], k_max=1)
    s.drives = [make.drive(end=ABORTED), make.drive(end=ABORTED)]
    outcome = s.run()
    assert (outcome.end, outcome.visits) == (End.CONFIRMED, 1)
    assert (outcome.rejected, outcome.set_aside) == ((), (0,))


def test_a_candidate_without_a_path_is_set_aside_before_anybody_is_asked(stage, extinguisher):
    s = stage([extinguisher])
    s.no_path = lambda goal: "no valid path"
    outcome = s.run()
    assert outcome.end is End.NAVIGATION_FAILED and outcome.set_aside == (0,)
    assert s.asked == [] and s.sent == []


def test_the_search_ends_when_three_candidates_were_set_aside(stage, make):
    s = stage([make.box(x, 5.0, "fire extinguisher", "fire extinguisher") for x in (1.5, 3.0, 4.5, 6.0)])
    s.drives = [make.drive(end=ABORTED)] * 6
    outcome = s.run()
    assert (outcome.end, outcome.set_aside, outcome.visits) == (End.NAVIGATION_FAILED, (0, 1, 2), 0)


def test_set_aside_after_a_rejection_ends_in_failed(stage, impostor, extinguisher, make):
    s = stage([impostor, extinguisher])
    s.drives = [make.drive(), make.drive(end=ABORTED), make.drive(end=ABORTED)]
    outcome = s.run()
    assert (outcome.end, outcome.reason, outcome.visits) == (End.FAILED, "no candidate left", 1)
    assert (outcome.rejected, outcome.set_aside) == ((0,), (1,))


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


def test_a_robot_that_faces_away_turns_and_then_confirms(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(turned=np.pi)]
    outcome = s.run()
    assert (outcome.end, outcome.visits) == (End.CONFIRMED, 1)
    assert s.path.count("re_observe") == 1
    assert s.sent[1].distance_to(s.sent[0]) < 1e-6  # in place


def test_what_stays_hidden_after_one_turn_and_one_move_is_rejected(stage, extinguisher, make):
    hood = make.box(5.0, 2.0, None, None, size=0.6, in_map=False)
    s = stage([extinguisher, hood])
    outcome = s.run()
    assert (outcome.end, outcome.rejected, outcome.visits) == (End.FAILED, (0,), 1)
    assert {c.verdict for c in s.of(records.Checks)} == {"insufficient visibility"}
    looks = [g for g in s.of(records.Goal) if g.purpose == "re-observe"]
    assert 1 <= len(looks) <= 2 and s.perceived == 1 + len(looks)


def test_a_re_observation_that_cannot_be_driven_sets_the_candidate_aside(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(turned=np.pi), make.drive(end=ABORTED)]
    outcome = s.run()
    assert (outcome.end, outcome.set_aside, outcome.visits) == (End.NAVIGATION_FAILED, (0,), 0)


def failing(times, error):
    """Raises the error at the first so many frames."""
    left = iter(range(times))

    def perceive() -> None:
        if next(left, None) is not None:
            raise error

    return perceive


def test_what_one_frame_did_not_show_is_looked_at_again_without_a_step(stage, extinguisher):
    s = stage([extinguisher])
    s.on_perceive = failing(1, FrameUnseen("no phrases: the reply is no list"))
    outcome = s.run()
    assert (outcome.end, outcome.visits) == (End.CONFIRMED, 1)
    assert s.path == ["retrieve", "await_approval", "navigate", "verify", "re_observe", "verify", "confirmed"]
    assert len(s.sent) == 1
    assert any("again: no phrases: the reply is no list" in sentence for sentence in s.told)
    first, second = s.of(records.Frame)[-2:]
    assert second.stamp_ns > first.stamp_ns


def test_what_no_frame_shows_to_perception_is_set_aside_and_the_next_one_is_tried(stage, impostor, make):
    s = stage([impostor, make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher")])

    def perceive() -> None:
        if s.robot.distance_to(Pose2(2.5, 5.0, 0.0)) < 2.0:
            raise FrameUnseen("no phrases: the reply is no list")

    s.on_perceive = perceive
    outcome = s.run()
    assert (outcome.end, outcome.object_id) == (End.CONFIRMED, 1)
    assert (outcome.rejected, outcome.set_aside, outcome.visits) == ((), (0,), 1)
    assert 2 <= s.path.count("re_observe") <= 3


def test_a_look_in_vain_and_too_little_in_view_end_all_the_same(stage, extinguisher, make):
    hood = make.box(5.0, 2.0, None, None, size=0.6, in_map=False)
    s = stage([extinguisher, hood])
    s.on_perceive = failing(1, FrameUnseen("no phrases"))
    outcome = s.run()
    assert (outcome.end, outcome.rejected) == (End.FAILED, (0,))


def test_a_perception_that_cannot_go_on_is_a_fault_in_its_own_words(stage, extinguisher):
    class ServerGone(PerceptionFailed):
        pass

    s = stage([extinguisher])
    s.on_perceive = failing(1, ServerGone("The model server does not answer: start it."))
    outcome = s.run()
    assert (outcome.end, outcome.reason) == (End.FAULT, "The model server does not answer: start it.")


def test_a_stop_that_perception_did_not_wait_for_cancels_and_replays(stage, extinguisher):
    s = stage([extinguisher])
    heard = []

    def perceive() -> None:
        heard.append(True)
        raise Interrupted("STOP came while perception looked at the frame.")

    s.on_perceive, s.stop_when = perceive, lambda: bool(heard)
    outcome = s.run()
    assert (outcome.end, outcome.reason) == (End.CANCELLED, "STOP pressed")
    assert s.of(records.Transition)[-1].source == "verify"
    assert s.cancelled


def test_a_trial_of_before_ends_at_a_frame_that_was_not_seen(stage, extinguisher):
    s = stage([extinguisher])
    s.policy = dataclasses.replace(s.policy, unlooked="fault")
    s.on_perceive = failing(1, FrameUnseen("no phrases"))
    assert s.run().reason == "unexpected FrameUnseen: no phrases"


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


STOPS = {
    "query": lambda s: True,
    "retrieve": lambda s: s.path[-1:] == ["retrieve"],
    "await_approval": lambda s: s.path[-1:] == ["await_approval"],
    "navigate": lambda s: len(s.sent) == 1,
    "verify": lambda s: s.perceived == 1,
    "re_observe": lambda s: s.path[-1:] == ["re_observe"],
    "exclude": lambda s: s.path[-1:] == ["exclude"],
}


@pytest.mark.parametrize("state", STOPS)
def test_stop_is_accepted_in_every_state(stage, impostor, extinguisher, make, state):
    s = stage([impostor, extinguisher])
    s.drives = [make.drive(turned=np.pi if state == "re_observe" else 0.0)]
    s.stop_when = lambda: STOPS[state](s)
    outcome = s.run()
    assert (outcome.end, outcome.reason) == (End.CANCELLED, "STOP pressed")
    assert s.of(records.Transition)[-1].source == state


def test_stop_while_driving_cancels_the_goal_within_a_tenth_of_a_second(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(end=None)]
    pressed_ns = s.clock.now_ns() + 3_000_000_000
    s.stop_when = lambda: s.clock.now_ns() >= pressed_ns
    assert s.run().end is End.CANCELLED
    assert s.cancelled == ["STOP pressed"]
    assert s.clock.now_ns() - pressed_ns <= 100_000_000


def test_an_unanswered_cancel_sends_the_operator_to_the_remote(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(end=None, cancel=NavigationResult(NavigationStatus.STILL_MOVING, "no answer in 1 s"))]
    s.stop_when = lambda: len(s.sent) == 1
    outcome = s.run()
    assert outcome.end is End.FAULT
    assert "the robot may still be moving: use the remote" in outcome.reason
    assert "use the remote" in s.told[-1]


def test_a_drive_that_never_ends_is_cancelled_and_counts_as_unreached(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(end=None)]
    outcome = s.run()
    assert outcome.end is End.CONFIRMED
    assert s.cancelled == ["no arrival within 180 s"] and len(s.sent) == 2


def test_a_lost_link_is_a_fault_and_the_goal_is_cancelled_still(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(end=NavigationResult(NavigationStatus.LOST, "the bridge went away"))]
    outcome = s.run()
    assert outcome.end is End.FAULT and "the bridge went away" in outcome.reason
    assert len(s.cancelled) == 1


@pytest.mark.parametrize("status", [NavigationStatus.CANCELED, NavigationStatus.PREEMPTED])
def test_somebody_elses_hand_on_the_robot_ends_the_mission(stage, extinguisher, make, status):
    s = stage([extinguisher])
    s.drives = [make.drive(end=NavigationResult(status, "another goal came from RViz"))]
    outcome = s.run()
    assert (outcome.end, outcome.reason) == (End.CANCELLED, "another goal came from RViz")
    assert len(s.sent) == 1


def test_a_rejected_goal_is_tried_from_the_next_pose(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(rejected=NavigationResult(NavigationStatus.REJECTED, "goal rejected"))]
    assert s.run().end is End.CONFIRMED
    assert len(s.sent) == 2


@pytest.mark.parametrize("error", [RuntimeError("boom"), PoseUnavailable("no transform")])
def test_an_exception_while_driving_cancels_the_goal_and_ends_in_fault(stage, extinguisher, make, error):
    s = stage([extinguisher])
    s.drives = [make.drive(raises=error)]
    outcome = s.run()
    assert outcome.end is End.FAULT and str(error) in outcome.reason
    assert len(s.cancelled) == 1


def test_an_exception_whose_cancel_fails_too_says_that_the_robot_may_move(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(raises=RuntimeError("boom"), cancel_raises=RuntimeError("link down"))]
    outcome = s.run()
    assert outcome.end is End.FAULT
    assert "boom" in outcome.reason and "use the remote" in outcome.reason


def test_an_interrupt_from_the_keyboard_cancels_the_goal_and_goes_on(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(raises=KeyboardInterrupt())]
    with pytest.raises(KeyboardInterrupt):
        s.run()
    assert len(s.cancelled) == 1


def test_a_camera_that_went_stale_at_arrival_is_a_fault_with_its_sentence(stage, extinguisher):
    s = stage([extinguisher])
    s.camera_works = lambda: s.sent == []
    outcome = s.run()
    assert outcome.end is End.FAULT and "9.0 s old" in outcome.reason
    assert s.perceived == 0


def test_a_camera_that_is_late_is_waited_for(stage, extinguisher):
    s = stage([extinguisher])
    ready_ns = s.clock.now_ns() + 800_000_000
    s.camera_works = lambda: s.clock.now_ns() >= ready_ns
    assert s.run().end is End.CONFIRMED


def test_a_robot_that_cannot_navigate_is_not_asked_about(stage, extinguisher):
    s = stage([extinguisher])
    s.unavailable = "Nav2 is not active."
    outcome = s.run()
    assert (outcome.end, outcome.reason) == (End.FAULT, "Nav2 is not active.")
    assert s.asked == []


def test_a_memory_that_changes_during_the_mission_is_a_fault(stage, extinguisher):
    from behaviors.mission import Mission
    from logs.trial.journal import ListJournal

    s = stage([extinguisher])

    def tamper() -> None:
        feature = s.memory.observations[0].feature
        feature.flags.writeable = True
        feature[:2] = feature[1::-1]
        feature.flags.writeable = False

    s.on_perceive = tamper
    outcome = Mission(s.ports, s.memory, s.parameters, s.policy, ListJournal()).run(SENTENCE)
    assert outcome.end is End.FAULT and "memory changed" in outcome.reason


def test_a_sentence_that_names_nothing_is_refused_before_anything_is_written(stage, extinguisher):
    s = stage([extinguisher])
    with pytest.raises(ValueError, match="names nothing"):
        s.run("please")
    assert s.journal.entries == []


def test_the_frame_that_is_judged_is_the_first_after_the_robot_was_seen_to_stand(stage, extinguisher):
    s = stage([extinguisher])
    s.run()
    _, arrival = s.of(records.Frame)  # one to measure the mount, one at arrival
    looks = s.of(records.PoseLook)
    assert 0.5e9 <= looks[-1].stamp_ns - looks[0].stamp_ns < 0.6e9
    assert looks[-1].stamp_ns <= arrival.stamp_ns < looks[-1].stamp_ns + 0.05e9


@pytest.mark.parametrize("hz", [5, 15, 30])
def test_no_frame_of_before_the_stand_is_judged_and_none_is_waited_for_longer_than_it_takes(stage, extinguisher, hz):
    s = stage([extinguisher])
    s.camera_period_ns = 1_000_000_000 // hz
    judged_ns = []
    s.on_perceive = lambda: judged_ns.append(s.clock.now_ns())
    assert s.run().end is End.CONFIRMED
    stood_ns = s.of(records.PoseLook)[-1].stamp_ns
    first_ns = -(-stood_ns // s.camera_period_ns) * s.camera_period_ns
    assert s.of(records.Frame)[-1].stamp_ns == first_ns
    assert judged_ns[0] - first_ns <= 0.02e9  # one look more


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


def test_who_stopped_is_in_the_trial(stage, extinguisher):
    s = stage([extinguisher])
    s.stop_when = lambda: True
    s.run()
    [stop] = s.of(records.Stop)
    assert (stop.because, stop.who, stop.how, stop.at_ns) == ("STOP pressed", "Ada", "stage", 7)


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
