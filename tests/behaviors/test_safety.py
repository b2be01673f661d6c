"""Missions under a supervisor and with a lidar. `stage.run` also replays each and fails where a decision differs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from behaviors.events import End
from behaviors.safety_conditions import GOAL_ZONE, OPERATOR_SILENT
from drivers.ports import NavigationResult, NavigationStatus, Reaction, SafetyVerdict
from logs.trial import records
from robot_app.mission.recorded import Asking, MissionSettings, run_recorded
from robot_app.mission.replay import replay_trial

GO = SafetyVerdict()
NOTHING = np.zeros((0, 3))


@pytest.fixture
def s(stage, make):
    return stage([make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher")])


def script(*runs: tuple[int, SafetyVerdict]) -> Callable[..., SafetyVerdict]:
    """A verdict port that says each verdict so many times, the last one for ever."""
    said = [verdict for count, verdict in runs for _ in range(count)]

    def verdict(goal) -> SafetyVerdict:
        return said.pop(0) if len(said) > 1 else said[0]

    return verdict


def wrong(reaction: Reaction, condition: str = "cloud") -> SafetyVerdict:
    return SafetyVerdict(reaction, condition, f"Something is wrong: {condition}.")


def blob(x: float, y: float) -> np.ndarray:
    return np.array([x, y, 0.8]) + np.random.default_rng(0).uniform(-0.02, 0.02, (20, 3))


def test_a_mission_that_nothing_is_wrong_with_leaves_no_verdict_in_its_trial(s):
    s.verdict = script((1, GO))
    assert s.run().end is End.CONFIRMED
    assert s.of(records.Supervised) == []


@pytest.mark.parametrize("reaction", [Reaction.NO_NEW_MOTION, Reaction.HOLD, Reaction.CANCEL])
def test_nothing_moves_where_the_supervisor_refuses_from_the_start(s, reaction):
    s.verdict = script((1, wrong(reaction)))
    outcome = s.run()
    assert (outcome.end, outcome.reason) == (End.FAULT, "Something is wrong: cloud.")
    assert s.sent == [] and s.asked == []


def test_no_new_motion_lets_a_drive_under_way_go_on(s):
    s.verdict = script((3, GO), (1, wrong(Reaction.NO_NEW_MOTION, "camera")))
    assert s.run().end is End.CONFIRMED
    assert s.cancelled == []


def test_a_cancel_under_way_ends_the_mission_with_its_sentence(s, make):
    s.drives = [make.drive(end=None)]
    s.verdict = script((10, GO), (1, wrong(Reaction.CANCEL, "link")))
    outcome = s.run()
    assert (outcome.end, outcome.reason) == (End.FAULT, "Something is wrong: link.")
    assert s.cancelled == ["Something is wrong: link."]


def test_a_hold_stops_the_robot_and_only_a_persons_yes_sends_it_on(s, make):
    s.drives = [make.drive(end=None), make.drive()]
    s.verdict = script((10, GO), (20, wrong(Reaction.HOLD)), (1, GO))
    outcome = s.run()
    assert outcome.end is End.CONFIRMED
    assert len(s.sent) == 2 and s.sent[0] == s.sent[1] and len(s.cancelled) == 1
    assert "May I walk on?" in s.asked[-1]


def test_after_a_hold_the_way_is_looked_at_again_before_the_goal_is_sent_again(s, make):
    s.drives = [make.drive(end=None), make.drive()]
    s.verdict = script((10, GO), (20, wrong(Reaction.HOLD)), (1, GO))
    s.cloud = lambda: blob(s.sent[0].x, s.sent[0].y) if s.cancelled else NOTHING
    assert s.run().end is End.CONFIRMED
    assert len(s.sent) == 2 and s.sent[1].distance_to(s.sent[0]) >= 0.5
    [moved] = [t for t in s.of(records.Transition) if t.event == "next_pose"]
    assert "stands where the robot would" in moved.because


def test_after_a_hold_a_way_that_is_gone_is_not_taken(s, make):
    s.drives, s.no_path = [make.drive(end=None)], lambda goal: "no valid path" if s.cancelled else None
    s.verdict = script((10, GO), (20, wrong(Reaction.HOLD)), (1, GO))
    outcome = s.run()
    assert outcome.end is End.NAVIGATION_FAILED and len(s.sent) == 1


def test_a_move_to_look_again_is_planned_and_looked_at_like_any_other(stage, make):
    hood = make.box(5.0, 2.0, None, None, size=0.6, in_map=False)
    s = stage([make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher"), hood])
    s.path_prefix = ((0.6, 7.0), (1.4, 7.0))
    s.cloud = lambda: blob(1.0, 7.0) if s.sent else NOTHING  # stands on the way once the robot has arrived
    outcome = s.run()
    [move] = [g for g in s.of(records.Goal) if g.purpose == "re-observe" and "move" in g.reason]
    assert move.pose is not None and len(s.of(records.Plan)) == 2
    assert (outcome.end, outcome.set_aside) == (End.NAVIGATION_FAILED, (0,))
    assert "stands on the way" in [t for t in s.of(records.Transition) if t.event == "unreached"][-1].because


def test_a_hold_that_is_over_does_not_move_the_robot_against_a_persons_no(s, make):
    s.drives, s.replies = [make.drive(end=None)], ["yes", "no"]
    s.verdict = script((10, GO), (20, wrong(Reaction.HOLD)), (1, GO))
    assert s.run().end is End.CANCELLED
    assert len(s.sent) == 1


def test_a_hold_that_does_not_end_is_a_fault_after_ten_seconds(s, make):
    s.drives = [make.drive(end=None)]
    s.verdict = script((10, GO), (1, wrong(Reaction.HOLD)))
    begun_ns = s.clock.now_ns()
    assert s.run().end is End.FAULT
    assert 10.0 < (s.clock.now_ns() - begun_ns) / 1e9 < 13.0


def test_data_that_comes_and_goes_is_given_up(s, make):
    s.drives = [make.drive(end=None)] * 9
    s.verdict = script((3, GO), *[(5, wrong(Reaction.HOLD)), (5, GO)] * 9)
    assert s.run().end is End.FAULT
    assert len(s.sent) == 4


def test_stop_is_heard_while_the_robot_is_held(s, make):
    s.drives = [make.drive(end=None)]
    s.verdict = script((10, GO), (1, wrong(Reaction.HOLD)))
    s.stop_when = lambda: len(s.cancelled) > 0 and len(s.told) > 0
    assert s.run().end is End.CANCELLED


def test_a_hold_whose_cancel_goes_unanswered_sends_the_operator_to_the_remote(s, make):
    unanswered = NavigationResult(NavigationStatus.STILL_MOVING, "The robot may still be moving: use the remote.")
    s.drives = [make.drive(end=None, cancel=unanswered)]
    s.verdict = script((10, GO), (1, wrong(Reaction.HOLD)))
    outcome = s.run()
    assert outcome.end is End.FAULT and "use the remote" in outcome.reason


def test_a_goal_in_a_forbidden_zone_is_not_sent_and_the_next_best_pose_is(s):
    goals = []

    def verdict(goal) -> SafetyVerdict:
        if goal is None:
            return GO
        if not goals:
            goals.append(goal)
        return wrong(Reaction.NO_NEW_MOTION, GOAL_ZONE) if goal == goals[0] else GO

    s.verdict = verdict
    assert s.run().end is End.CONFIRMED
    assert goals[0] not in s.sent and len(s.sent) == 1


def test_a_clear_cloud_changes_nothing_and_is_in_the_trial(s):
    s.cloud = lambda: blob(1.0, 7.0)
    assert s.run().end is End.CONFIRMED
    assert len(s.sent) == 1
    assert len(s.of(records.Cloud)) == 2  # before the goal, and at arrival


def test_a_goal_that_the_lidar_sees_blocked_moves_to_the_next_best_pose_with_that_reason(stage, s, make):
    first = stage([make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher")])
    first.run()
    taken = first.sent[0]
    s.cloud = lambda: blob(taken.x, taken.y)
    assert s.run().end is End.CONFIRMED
    assert s.sent[0].distance_to(taken) >= 0.5
    [moved] = [t for t in s.of(records.Transition) if t.event == "next_pose"]
    assert "stands where the robot would" in moved.because


def test_a_way_that_the_lidar_sees_blocked_is_not_walked(s):
    s.path_prefix = ((1.0, 1.0), (1.5, 1.0), (2.0, 1.0))
    s.cloud = lambda: blob(2.0, 1.0)
    outcome = s.run()
    assert (outcome.end, outcome.set_aside) == (End.NAVIGATION_FAILED, (0,))
    assert s.sent == []
    [unreached] = [t for t in s.of(records.Transition) if t.event == "unreached"]
    assert "stands on the way, 0.8 m from here" in unreached.because  # where its body would touch


def test_somebody_beside_the_robot_at_arrival_sends_it_to_the_next_best_pose(s):
    s.cloud = lambda: blob(s.sent[0].x, s.sent[0].y + 0.42) if len(s.sent) == 1 else NOTHING
    assert s.run().end is End.CONFIRMED
    assert len(s.sent) == 2
    [moved] = [t for t in s.of(records.Transition) if t.event == "next_pose"]
    assert "of the robot" in moved.because


def test_a_crowded_robot_with_nowhere_else_to_go_looks_from_where_it_is(s):
    s.no_path = lambda goal: "no valid path" if s.sent else None
    s.cloud = lambda: blob(s.sent[0].x, s.sent[0].y + 0.42) if s.sent else NOTHING
    outcome = s.run()
    assert outcome.end is End.CONFIRMED and len(s.sent) == 1


def test_verdicts_and_clouds_come_back_from_the_trials_file_and_replay_to_the_same_decisions(s, make, tmp_path):
    s.cloud, s.drives = lambda: blob(1.0, 7.0), [make.drive(end=None), make.drive()]
    s.path_prefix = ((1.0, 1.0), (1.5, 1.0))
    s.verdict = script((10, GO), (20, wrong(Reaction.HOLD)), (1, GO))
    s.memory.save(tmp_path / "site.belief")
    outcome, failure = run_recorded(
        tmp_path / "trial.mcap",
        Asking(sentence="take me to the fire extinguisher"),
        ports=s.ports,
        memory=s.memory,
        memory_path=tmp_path / "site.belief",
        settings=MissionSettings(parameters=s.parameters, policy=s.policy),
        trial_id="trial-1",
        query_id="query-1",
    )
    assert (outcome.end, failure) == (End.CONFIRMED, None)
    replayed = replay_trial(tmp_path / "trial.mcap")
    assert replayed.difference is None
    kept = replayed.trial.records
    assert [v.reaction for v in kept if isinstance(v, records.Supervised)] == ["hold", "go"]
    plans = [p for p in kept if isinstance(p, records.Plan)]
    assert [plan.path_prefix for plan in plans] == [
        s.path_prefix,
        s.path_prefix,
    ]  # before the drive, and again after the hold
    clouds = [e.attached for e in replayed.trial.entries if isinstance(e.record, records.Cloud)]
    assert {len(cloud.points) for cloud in clouds} == {20}


def test_holds_by_the_operators_page_do_not_add_up_to_a_fault(s, make):
    s.drives = [make.drive(end=None)] * 5 + [make.drive()]
    hold = SafetyVerdict(Reaction.HOLD, OPERATOR_SILENT, "The page is not on a screen.")
    s.verdict = script(*[run for _ in range(5) for run in ((10, GO), (5, hold))], (1, GO))
    assert s.run().end is End.CONFIRMED
    assert len(s.cancelled) == 5 and s.asked.count(next(q for q in s.asked if "May I walk on" in q)) == 5
