"""What one look from a goal pose measures of a stored place, before anything there is named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from openbelief.arrays import Array, unit_vector
from openbelief.backprojection import backproject, snap
from openbelief.grounded.arrival import SeenThere
from openbelief.observation import Mask, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.phrase import comparable
from openbelief.verification import overlap_at
from openbelief.visibility import Visibility, visibility

Look: TypeAlias = tuple[SeenThere, ...]  # what one look saw at the place


@dataclass(frozen=True)
class Here:
    """A mask of the frame: how much of it is at the stored place, None where it says nothing or its depth does not."""

    index: int
    seen: SeenThere
    overlap: float | None


@dataclass(frozen=True)
class Looked:
    """What one look measured of a stored place, before anything is named. found: of every mask of the frame."""

    shown: Visibility
    found: tuple[Here, ...]
    pose_error_m: float

    def at_place(self, tau_arr: float) -> list[Here]:
        return [one for one in self.found if one.overlap is not None and one.overlap >= tau_arr]


def look_at(
    node_points: Array,
    frame: RgbdFrame,
    masks: Sequence[Mask],
    parameters: Parameters,
    dim: int | None,
    pose_error_m: float = 0.10,
) -> Looked:
    """What no query changes. dim: of the features, None where they say nothing of words."""
    shown = visibility(node_points, frame, parameters, pose_error_m)
    found = (_here(mask, node_points, frame, parameters, dim, pose_error_m) for mask in masks)
    return Looked(shown, tuple(found), pose_error_m)


def _here(
    mask: Mask, node_points: Array, frame: RgbdFrame, parameters: Parameters, dim: int | None, pose_error_m: float
) -> Here:
    voxels = len(snap(backproject(mask.pixels, frame, parameters), parameters.voxel_m))
    feature = None if dim is None else unit_vector(mask.feature, f"Mask {mask.index}: feature")
    if feature is not None and len(feature) != dim:
        raise ValueError(
            f"Mask {mask.index}: feature has {len(feature)} numbers, the query {dim}; they cannot be compared."
        )
    seen = SeenThere(comparable(mask.phrase), float(mask.confidence) * voxels**0.5, feature)
    says_nothing = seen.phrase is None and feature is None
    overlap = None if says_nothing else overlap_at(node_points, mask, frame, parameters, pose_error_m)
    return Here(mask.index, seen, overlap)
