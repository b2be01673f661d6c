"""Stories of Algorithm 1. `stage.run` also replays every one of them and fails where a decision differs."""

from __future__ import annotations

import dataclasses
import sys

import numpy as np
import pytest

from behaviors.events import End
from behaviors.mission import Mission
from drivers.ports import NavigationResult, NavigationStatus
from logs.trial import records
from logs.trial.journal import ListJournal
from openbelief.perception.sentence import SentenceEncoder
from openbelief.target_phrase import target_phrase

ABORTED = NavigationResult(NavigationStatus.ABORTED, "no valid path", 208)
SENTENCE = "take me to the fire extinguisher"


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

    for module in ("openbelief.memory", "openbelief.memory_query", "openbelief.request.parse"):
        monkeypatch.setattr(sys.modules[module], "target_phrase", counted)
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


def test_a_robot_that_cannot_navigate_is_not_asked_about(stage, extinguisher):
    s = stage([extinguisher])
    s.unavailable = "Nav2 is not active."
    outcome = s.run()
    assert (outcome.end, outcome.reason) == (End.FAULT, "Nav2 is not active.")
    assert s.asked == []


def test_a_memory_that_changes_during_the_mission_is_a_fault(stage, extinguisher):
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


def test_who_stopped_is_in_the_trial(stage, extinguisher):
    s = stage([extinguisher])
    s.stop_when = lambda: True
    s.run()
    [stop] = s.of(records.Stop)
    assert (stop.because, stop.who, stop.how, stop.at_ns) == ("STOP pressed", "Ada", "stage", 7)
