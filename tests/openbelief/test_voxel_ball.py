"""A ball between voxels: what is within r of a cloud, however it is drawn."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief import voxel_ball as balls
from openbelief.voxel_ball import voxel_ball

SIDES = np.array([14, 11, 17])


def within(voxels: np.ndarray, radius_voxels: float) -> np.ndarray:
    """By every distance."""
    cells = np.stack(np.unravel_index(np.arange(SIDES.prod()), SIDES), axis=1)
    return (np.linalg.norm(cells[:, None] - voxels[None], axis=2) <= radius_voxels).any(axis=1)


@pytest.mark.parametrize("small", [1 << 14, 0], ids=["the grid is moved", "steps are taken"])
@pytest.mark.parametrize("radius_voxels", [0.5, 1.0, 1.4, 1.5, 2.0, 2.5, 4.0])
def test_a_cloud_grown_by_the_ball_is_what_lies_within_its_radius(monkeypatch, small, radius_voxels):
    monkeypatch.setattr(balls, "SMALL", small)
    monkeypatch.setattr(balls, "DENSE", 0)
    ball = voxel_ball(radius_voxels * 0.02, 0.02)
    for seed, count in enumerate((1, 3, 40)):
        voxels = np.random.default_rng(seed).integers(ball.reach, SIDES - ball.reach, (count, 3))
        at = np.ravel_multi_index(voxels.T, SIDES).astype(np.int32)
        assert (ball.grown(at, SIDES) == within(voxels, radius_voxels)).all()


def test_a_radius_of_too_many_voxels_has_no_ball():
    assert voxel_ball(0.2, 0.02).columns == () and voxel_ball(0.2, 0.02).slack_m < 0
