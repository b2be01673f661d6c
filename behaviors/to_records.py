"""What the core computed, as the trial's records."""

from __future__ import annotations

from collections.abc import Sequence

from behaviors.asking import Retrieved
from behaviors.events import End, Outcome
from behaviors.reobserve import Look
from drivers.ports import PathPlan
from logs.trial import records
from openbelief.goal_pose import GoalPose
from openbelief.grounded.arrival import RelativeCheck
from openbelief.memory import Candidate, ObjectMemory
from openbelief.verification import ArrivalChecks


def scored(candidate: Candidate, memory: ObjectMemory) -> records.Scored:
    return records.Scored(
        object_id=candidate.object_id,
        score=float(candidate.score),
        visual=None if candidate.visual is None else float(candidate.visual),
        language=None if candidate.language is None else float(candidate.language),
        label=memory.objects[candidate.object_id].label,
    )


def ranking_record(
    found: Retrieved,
    memory: ObjectMemory,
    target: str,
    readout: str,
    rejected: Sequence[int],
    set_aside: Sequence[int],
) -> records.Ranking:
    answer = found.answer
    return records.Ranking(
        target=target,
        readout=readout,
        rejected=tuple(rejected),
        set_aside=tuple(set_aside),
        candidates=tuple(scored(candidate, memory) for candidate in found.candidates),
        answer=None if answer is None else answer.answer,
        because="" if answer is None else answer.because,
        understood=None if answer is None else answer.understood,
        terms=() if answer is None else tuple(candidate.terms for candidate in answer.candidates),
    )


def chosen_record(attempt: int, label: str, candidate: Candidate) -> records.Chosen:
    return records.Chosen(attempt=attempt, object_id=candidate.object_id, label=label, score=float(candidate.score))


def goal_record(object_id: int, goal: GoalPose, plan: PathPlan) -> records.Goal:
    return records.Goal(
        object_id=object_id,
        purpose="approach",
        pose=records.PlanarPose.of(goal.pose),
        expected_visibility=float(goal.expected_visibility),
        path_length_m=plan.length_m,
        reason=plan.reason,
    )


def no_goal_record(object_id: int, reason: str) -> records.Goal:
    return records.Goal(
        object_id=object_id,
        purpose="approach",
        pose=None,
        expected_visibility=None,
        path_length_m=None,
        reason=reason,
    )


def look_record(object_id: int, look: Look) -> records.Goal:
    return records.Goal(
        object_id=object_id,
        purpose="re-observe",
        pose=records.PlanarPose.of(look.pose),
        expected_visibility=look.expected_visibility,
        path_length_m=None,
        reason=look.reason,
    )


def checks_record(
    object_id: int, frame_stamp_ns: int, checks: ArrivalChecks, relative: RelativeCheck | None = None
) -> records.Checks:
    shown = checks.visibility
    return records.Checks(
        object_id=object_id,
        frame_stamp_ns=frame_stamp_ns,
        visibility=records.Check(value=float(shown.nu), threshold=float(checks.tau_nu)),
        semantic=records.Check(value=checks.semantic, threshold=float(checks.tau_q)),
        geometric=records.Check(value=checks.overlap, threshold=float(checks.tau_arr)),
        expected=int(shown.expected),
        occluded=float(shown.occluded),
        out_of_view=float(shown.out_of_view),
        no_depth=float(shown.no_depth),
        see_through=float(shown.see_through),
        pose_error_m=float(checks.pose_error_m),
        mask_index=checks.best_mask,
        verdict=checks.verdict,
        reason=checks.reason,
        relative=None if relative is None else _relative(relative),
    )


def _relative(check: RelativeCheck) -> records.Relative:
    """Where nothing else is left on the map the lead is over nothing: None."""
    naming = check.naming
    return records.Relative(
        lead=None if check.rival is None else float(check.lead),
        rival=check.rival,
        called=naming.called,
        contrast=float(naming.contrast),
        asked_like=float(naming.asked_like),
        looks_like=naming.looks_like,
        rival_like=float(naming.rival_like),
    )


def ended_record(outcome: Outcome) -> records.Ended:
    return records.Ended(
        end=outcome.end,
        reason=outcome.reason,
        visits=outcome.visits,
        object_id=outcome.object_id,
        rejected=outcome.rejected,
        set_aside=outcome.set_aside,
        declined=outcome.declined,
    )


def outcome_of(ended: records.Ended) -> Outcome:
    """The outcome that a trial recorded: the inverse of `ended_record`."""
    return Outcome(End(ended.end), ended.reason, ended.visits, ended.object_id, ended.rejected, ended.set_aside)
