"""Every number of the paper in one place, with its symbol and equation; gaps filled by the reasons beside them."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from openbelief.settings import CHECKED, Cosine, Flag, Fraction, Number, Positive, Whole, in_one_line

NotNegative = Annotated[Number, Field(ge=0)]
NoCount = Annotated[Whole, Field(ge=0)]
Count = Annotated[Whole, Field(ge=1)]
ACQUISITION = (  # what was left out of a frame by one of these is not in the evidence
    "voxel_m",
    "depth_min_m",
    "depth_max_m",
    "min_mask_px",
    "min_points",
    "cluster_eps_m",
    "cluster_min_points",
)


@in_one_line("Parameter")
@dataclass(frozen=True, config=CHECKED)
class Parameters:
    """Defaults are the paper's where it gives one.

    Raises ValueError on a value of the wrong kind, or a number that is not finite or out of range.
    """

    # Acquisition (Sec. III-B)
    voxel_m: Positive = 0.02  # HOV-SG; one point per occupied voxel, or Omega_r would depend on point density
    depth_min_m: NotNegative = 0.1
    depth_max_m: Number = 6.0
    min_mask_px: NoCount = 100
    min_points: NoCount = 50  # pixels of a mask with depth in range; of voxels, 50 would drop what is small or far
    cluster_eps_m: Positive = 0.08  # the largest DBSCAN cluster of a mask keeps flying pixels out
    cluster_min_points: Count = 10

    # Association (eq. association)
    tau_g: Fraction = 0.75
    tau_v: Cosine = 0.85
    radius_m: Positive = 0.03  # r = 1.5 voxels (HOV-SG)
    extent_alarm_m: Positive = 4.0  # reported, never silently split
    extent_alarm_ratio: Positive = 3.0

    # Belief (eqs. reliability-weight, concept-vote, dirichlet-belief, reliability)
    weight: Literal["sqrt", "uniform", "linear"] = "sqrt"  # w_e = c sqrt(n); ablations w_e = 1 and c n
    consolidate: Flag = True  # False: every phrase is its own concept (ablation)
    synonym_threshold: Cosine | None = None  # None: the encoder's own (0.80 sentence encoder, 0.90 CLIP text)
    alpha: Positive = 0.5  # above 0: regularize = False is the ablation
    m_min: Count = 3
    trust_counts: Literal["observations", "frames"] = "observations"  # three masks of one frame are not three looks
    regularize: Flag = True  # False: alpha = 0 and every node trusted (ablation)

    # Free-form retrieval (eqs. retrieval-score, reliability-fusion)
    lambda_no_language: Fraction = 1.0
    lambda_degraded: Fraction = 0.7
    lambda_trusted: Fraction = 0.2
    fusion: Literal["paper", "calibrated"] = "paper"  # calibrated: z-score per channel over the map

    # Fixed-vocabulary projection (eqs. belief-refinement, fixed-vocab-readout)
    gamma: Annotated[Positive, Field(le=1)] = 0.5
    t_vis: Positive = 0.1
    t_proj: Positive = 0.02
    t_obj: Positive = 0.02
    lambda_vis: Fraction = 0.25

    # Correction (Sec. III-F)
    tau_nu: Fraction = 0.25
    tau_q: Cosine | None = None  # None: the encoder's own (0.45 sentence encoder; the paper's 0.50 for SAM 3 / CLIP)
    tau_arr: Fraction = 0.2
    k_max: Count = 2

    @model_validator(mode="after")
    def _depths(self) -> Parameters:
        if self.depth_max_m <= self.depth_min_m:
            raise ValueError(f"Parameter depth_max_m must be greater than depth_min_m, got {self.depth_max_m}.")
        return self

    def to_dict(self) -> dict[str, Any]:
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Parameters:
        """Raises ValueError naming an unknown key."""
        return cls(**values)
