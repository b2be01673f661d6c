"""Every number of the paper in one place, with its symbol and equation; gaps filled by the reasons beside them."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True)
class Parameters:
    """Defaults are the paper's where it gives one. Raises ValueError on a number that is not finite or out of range."""

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
            value = getattr(self, spec.name)
            if isinstance(value, float) and not math.isfinite(value):
                raise ValueError(f"Parameter {spec.name} must be finite, got {value}.")
        for name in ("voxel_m", "radius_m", "t_vis", "t_proj", "t_obj", "cluster_eps_m"):
            if getattr(self, name) <= 0:
                raise ValueError(f"Parameter {name} must be greater than 0, got {getattr(self, name)}.")
        for name in (
            "tau_g",
            "tau_nu",
            "tau_arr",
            "gamma",
            "lambda_vis",
            "lambda_no_language",
            "lambda_degraded",
            "lambda_trusted",
        ):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"Parameter {name} must be in [0, 1], got {getattr(self, name)}.")
        if self.alpha <= 0:
            raise ValueError(
                f"Parameter alpha must be greater than 0, got {self.alpha} (regularize=false is the ablation)."
            )
        if self.k_max < 1 or self.m_min < 1 or self.gamma == 0:
            raise ValueError("Parameters k_max and m_min must be at least 1, and gamma greater than 0.")

    def to_dict(self) -> dict[str, Any]:
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Parameters:
        """Raises ValueError naming an unknown key."""
        known = {spec.name for spec in dataclasses.fields(cls)}
        if unknown := sorted(set(values) - known):
            raise ValueError(f"Unknown parameter {unknown[0]!r}; known are {', '.join(sorted(known))}.")
        return cls(**values)
