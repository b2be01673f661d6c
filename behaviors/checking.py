"""The arrival checks at a candidate, by the policy's kind: the paper's, or relative to the map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from behaviors.policy import MissionPolicy
from behaviors.query import QueryProgress
from openbelief.grounded.arrival import RelativeCheck
from openbelief.grounded.options import GroundedOptions
from openbelief.memory import ObjectMemory
from openbelief.observation import Mask, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.relative_verification import Wanted, verify_relative
from openbelief.verification import ArrivalChecks, Verdict, verify


def checks_of(
    frame: RgbdFrame,
    masks: Sequence[Mask],
    query: QueryProgress,
    memory: ObjectMemory,
    policy: MissionPolicy,
    parameters: Parameters,
    grounded: GroundedOptions,
    *,
    feature_text_aligned: bool,
) -> tuple[ArrivalChecks, RelativeCheck | None]:
    """What a doubtful look saw is kept with the attempt: the next look at this candidate counts both."""
    attempt = query.current
    if policy.arrival_check == "paper":
        checks = verify(
            attempt.node.points,
            frame,
            masks,
            query.asked.f_q.astype(np.float32),
            memory.text_encoder,
            parameters,
            feature_text_aligned=feature_text_aligned,
            pose_error_m=policy.pose_error_m,
        )
        return checks, None
    reader, excluded = memory.reader(grounded), frozenset(query.rejected + query.set_aside)
    reading = reader.read(query.asked, query.viewer)
    verified = verify_relative(
        attempt.node.points,
        frame,
        masks,
        Wanted(reader, reading, query.asked, attempt.node.id, excluded),
        parameters,
        attempt.doubted,
        feature_text_aligned=feature_text_aligned,
        pose_error_m=policy.pose_error_m,
    )
    if verified.checks.verdict is Verdict.DOUBTFUL:
        attempt.doubted = (*attempt.doubted, verified.seen)
    return verified.checks, verified.relative
