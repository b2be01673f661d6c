"""`arrival_check = "relative"`: on arrival the map is asked again, and what is in doubt is looked at once more."""

from __future__ import annotations

from dataclasses import replace

import pytest

from behaviors.events import End
from behaviors.policy import MissionPolicy
from logs.trial import records
from logs.trial.compare import compare_decisions
from robot_app.mission.replay import BEFORE

EXTINGUISHER = ("fire extinguisher", "fire extinguisher")


@pytest.fixture
def arrive(stage, make):
    """A stage whose mission checks relative to the map: what each box is mapped as and seen as, best first."""

    def made(*boxes: tuple[str, str], **policy):
        spots = ((2.5, 5.0), (5.0, 2.0), (5.5, 5.5), (2.0, 2.6))
        s = stage([make.box(*at, *names) for at, names in zip(spots, boxes, strict=False)])
        s.policy = replace(s.policy, arrival_check="relative", **policy)
        return s

    return made


def verdicts(s) -> list[str]:
    return [check.verdict for check in s.of(records.Checks)]


def test_new_missions_check_relative_to_the_map_and_old_trials_replay_by_the_papers_check():
    assert MissionPolicy().arrival_check == "relative"
    assert MissionPolicy.from_dict(BEFORE).arrival_check == "paper"
    with pytest.raises(ValueError, match="arrival_check"):
        MissionPolicy.from_dict({"arrival_check": "absolute"})


def test_what_looks_as_it_was_asked_for_is_confirmed_at_the_first_look(arrive):
    s = arrive(EXTINGUISHER, ("sofa", "sofa"))
    assert s.run().end is End.CONFIRMED and verdicts(s) == ["confirmed"]
    (check,) = s.of(records.Checks)
    assert check.reason.startswith("From near it looks like a fire extinguisher (1.00), at the stored place")
    assert check.semantic.value > check.semantic.threshold == 0.65
    assert check.relative.lead > 0 and check.relative.rival == 1 and check.relative.contrast > 0


def test_an_impostor_is_looked_at_once_more_then_rejected_and_the_next_one_confirmed(arrive):
    s = arrive(("fire extinguisher", "blue vase"), EXTINGUISHER)
    outcome = s.run()
    assert (outcome.end, outcome.visits, outcome.object_id, outcome.rejected) == (End.CONFIRMED, 2, 1, (0,))
    assert verdicts(s) == ["doubtful", "no matching mask", "confirmed"]
    assert s.path.count("re_observe") == 1
    assert any("once more: From near it looks like a blue vase (1.00), not a fire" in said for said in s.told)
    second = s.of(records.Checks)[1]
    assert "(1.00), not a fire extinguisher" in second.reason and second.relative.called == "blue vase"


def test_the_papers_check_rejects_it_at_the_first_look_as_before(arrive):
    s = arrive(("fire extinguisher", "blue vase"), EXTINGUISHER)
    s.policy = replace(s.policy, arrival_check="paper")
    s.run()
    assert verdicts(s) == ["no matching mask", "confirmed"]
    assert all(check.relative is None for check in s.of(records.Checks))


def test_a_name_that_perception_slips_on_once_costs_a_look_and_no_candidate(arrive):
    s = arrive(("fire extinguisher", "blue vase"), ("sofa", "sofa"))

    def better() -> None:
        if s.perceived:
            s.boxes[0] = replace(s.boxes[0], seen="fire extinguisher")

    s.on_perceive = better
    outcome = s.run()
    assert (outcome.end, outcome.visits, verdicts(s)) == (End.CONFIRMED, 1, ["doubtful", "confirmed"])


def test_the_second_look_is_another_frame_even_where_there_is_nowhere_else_to_stand(arrive, make):
    s = arrive(("fire extinguisher", "blue vase"), EXTINGUISHER)
    s.no_path = lambda goal: "blocked" if s.sent else None
    s.drives = [make.drive(turned=0.0)]
    s.run()
    stamps = [check.frame_stamp_ns for check in s.of(records.Checks)]
    assert len(set(stamps)) == len(stamps)


def test_what_a_replay_is_told_decides_it_too(arrive):
    """The same inputs under the paper's check end otherwise: the setting is part of what a trial records."""
    s = arrive(("fire extinguisher", "blue vase"), EXTINGUISHER)
    s.run()
    s.policy = replace(s.policy, arrival_check="paper")
    difference = compare_decisions(s.journal.decisions, s.replayed("take me to the fire extinguisher"))
    assert difference is not None and difference.topic == records.Checks.topic


def test_the_memory_answers_as_before(arrive):
    s = arrive(("fire extinguisher", "blue vase"), EXTINGUISHER)
    before = s.memory.fingerprint()
    s.run()
    assert s.memory.fingerprint() == before
