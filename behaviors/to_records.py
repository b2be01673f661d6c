"""What the core computed, as the trial's records."""

from __future__ import annotations

from collections.abc import Sequence

from logs import trial_records as records
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
    candidates: Sequence[Candidate],
    memory: ObjectMemory,
    *,
    target: str,
    readout: str,
    rejected: Sequence[int],
    set_aside: Sequence[int],
) -> records.Ranking:
    return records.Ranking(
        target=target,
        readout=readout,
        rejected=tuple(rejected),
        set_aside=tuple(set_aside),
        candidates=tuple(scored(candidate, memory) for candidate in candidates),
    )


def checks_record(object_id: int, frame_stamp_ns: int, checks: ArrivalChecks) -> records.Checks:
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
    )
