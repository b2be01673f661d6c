"""Every number of the paper in one place, with its symbol and equation; gaps filled by the reasons beside them."""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, get_args, get_origin, get_type_hints


@dataclass(frozen=True)
class Parameters:
    """Defaults are the paper's where it gives one.

    Raises ValueError on a value of the wrong kind, or a number that is not finite or out of range.
    """

    # Acquisition (Sec. III-B)
    voxel_m: float = 0.02  # HOV-SG; one point per occupied voxel, or Omega_r would depend on point density
    depth_min_m: float = 0.1
    depth_max_m: float = 6.0
    min_mask_px: int = 100
    min_points: int = 50  # pixels of a mask with depth in range; of voxels, 50 would drop what is small or far
    cluster_eps_m: float = 0.08  # the largest DBSCAN cluster of a mask keeps flying pixels out
    cluster_min_points: int = 10

    # Association (eq. association)
    tau_g: float = 0.75
    tau_v: float = 0.85
    radius_m: float = 0.03  # r = 1.5 voxels (HOV-SG)
    extent_alarm_m: float = 4.0  # reported, never silently split
    extent_alarm_ratio: float = 3.0

    # Belief (eqs. reliability-weight, concept-vote, dirichlet-belief, reliability)
    weight: Literal["sqrt", "uniform", "linear"] = "sqrt"  # w_e = c sqrt(n); ablations w_e = 1 and c n
    consolidate: bool = True  # False: every phrase is its own concept (ablation)
    synonym_threshold: float | None = None  # None: the encoder's own (0.80 sentence encoder, 0.90 CLIP text)
    alpha: float = 0.5
    m_min: int = 3
    trust_counts: Literal["observations", "frames"] = "observations"  # three masks of one frame are not three looks
    regularize: bool = True  # False: alpha = 0 and every node trusted (ablation)

    # Free-form retrieval (eqs. retrieval-score, reliability-fusion)
    lambda_no_language: float = 1.0
    lambda_degraded: float = 0.7
    lambda_trusted: float = 0.2
    fusion: Literal["paper", "calibrated"] = "paper"  # calibrated: z-score per channel over the map

    # Fixed-vocabulary projection (eqs. belief-refinement, fixed-vocab-readout)
    gamma: float = 0.5
    t_vis: float = 0.1
    t_proj: float = 0.02
    t_obj: float = 0.02
    lambda_vis: float = 0.25

    # Correction (Sec. III-F)
    tau_nu: float = 0.25
    tau_q: float | None = None  # None: the encoder's own (0.45 sentence encoder; the paper's 0.50 for SAM 3 / CLIP)
    tau_arr: float = 0.2
    k_max: int = 2

    def __post_init__(self) -> None:
        for spec in dataclasses.fields(self):
            kind = _kinds()[spec.name]
            value = _plain(getattr(self, spec.name), kind)
            if not _fits(value, kind):
                raise ValueError(f"Parameter {spec.name} should be {_named(kind)}, got {value!r}.")
            if isinstance(value, float) and not math.isfinite(value):
                raise ValueError(f"Parameter {spec.name} must be finite, got {value}.")
            object.__setattr__(self, spec.name, value)
        for names, fits, words in RANGES:
            for name in names:
                value = getattr(self, name)
                if value is not None and not fits(value):
                    raise ValueError(f"Parameter {name} must be {words}, got {value}.")
        if self.depth_max_m <= self.depth_min_m:
            raise ValueError(f"Parameter depth_max_m must be greater than depth_min_m, got {self.depth_max_m}.")

    def to_dict(self) -> dict[str, Any]:
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Parameters:
        """Raises ValueError naming an unknown key."""
        known = {spec.name for spec in dataclasses.fields(cls)}
        if unknown := sorted(set(values) - known):
            raise ValueError(f"Unknown parameter {unknown[0]!r}; known are {', '.join(sorted(known))}.")
        return cls(**values)


RANGES: tuple[tuple[tuple[str, ...], Callable[[Any], bool], str], ...] = (
    (("voxel_m", "radius_m", "cluster_eps_m", "extent_alarm_m"), lambda v: v > 0, "greater than 0"),
    (("t_vis", "t_proj", "t_obj", "extent_alarm_ratio"), lambda v: v > 0, "greater than 0"),
    (("alpha",), lambda v: v > 0, "greater than 0 (regularize=false is the ablation)"),
    (("tau_g", "tau_nu", "tau_arr", "lambda_vis"), lambda v: 0 <= v <= 1, "in [0, 1]"),
    (("lambda_no_language", "lambda_degraded", "lambda_trusted"), lambda v: 0 <= v <= 1, "in [0, 1]"),
    (("gamma",), lambda v: 0 < v <= 1, "in (0, 1]"),
    (("tau_v", "synonym_threshold", "tau_q"), lambda v: -1 <= v <= 1, "in [-1, 1]"),  # cosines
    (("min_mask_px", "min_points", "depth_min_m"), lambda v: v >= 0, "at least 0"),
    (("cluster_min_points", "m_min", "k_max"), lambda v: v >= 1, "at least 1"),
)


@cache
def _kinds() -> dict[str, Any]:
    return get_type_hints(Parameters)


def _plain(value: Any, kind: Any) -> Any:
    """numpy's scalars as Python's, and whole numbers as the floats that a number is kept as: one value, one hash."""
    if getattr(value, "shape", None) == ():
        value = value.item()
    if type(value) is not int or not (kind is float or float in get_args(kind)):
        return value
    return float(value) if abs(value) < sys.float_info.max else math.inf


def _fits(value: object, kind: Any) -> bool:
    """Whether a value is of an annotated kind; a misspelt word or a broken number is found here, not in a formula."""
    if get_origin(kind) is Literal:
        return value in get_args(kind)
    if choices := get_args(kind):
        return any(_fits(value, choice) for choice in choices)
    if kind is float:
        return isinstance(value, float)
    return type(value) is kind


def _named(kind: Any) -> str:
    if get_origin(kind) is Literal:
        return "one of " + ", ".join(get_args(kind))
    names = {float: "a number", int: "a whole number", bool: "true or false", type(None): "left out"}
    return " or ".join(names[one] for one in get_args(kind) or (kind,))
