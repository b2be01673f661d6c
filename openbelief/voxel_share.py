"""The share of one cloud that is within r of another (half of Omega_r): on voxels where they decide, else by tree.

Acquisition puts every point on its voxel's centre. Between such points distances take few values, so the voxels within
r of a cloud are its voxels grown by a ball, and whether a point is near is one look into a grid.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from openbelief.arrays import Array
from openbelief.voxel_ball import MAX_STEP, ROUNDING_M, voxel_ball

MAX_CELLS = 1 << 26  # bytes of the grid around one cloud: a wall of 20 m across a diagonal fits
CHUNK = 32  # clouds turned into voxels at once


class VoxelClouds:
    """Clouds as numbers of voxels, counted from the first cloud.

    voxels: (3, N) int16, or int32 where int16 ends; cloud i is at start[i] : start[i + 1]. low, high: (n, 3) float32
    corners of the clouds' boxes, map frame, metres. exact: (n,) bool, where distances between a cloud's voxels decide
    as distances between its points do: no point is farther than `slack_m` from its voxel's centre along an axis.
    """

    def __init__(self, clouds: Sequence[Array], voxel_m: float, slack_m: float) -> None:
        self.points, self.size = clouds, np.array([len(cloud) for cloud in clouds])
        self.start = np.concatenate(([0], np.cumsum(self.size)))
        self.low, self.high = np.empty((2, len(clouds), 3), np.float32)
        self._origin = np.floor(clouds[0][0].astype(np.float64) / voxel_m)
        for dtype in (np.int16, np.int32):
            self.voxels = np.empty((3, self.start[-1]), dtype)
            self.exact = np.ones(len(clouds), bool)
            farthest = np.iinfo(dtype).max // 2 - 2 * MAX_STEP  # differences, and steps away, stay within the type
            chunks = [slice(a, min(a + CHUNK, len(clouds))) for a in range(0, len(clouds), CHUNK)]
            within = [self._fill(chunk, voxel_m, slack_m, farthest) for chunk in chunks]
            if all(within):
                break

    def _fill(self, chunk: slice, voxel_m: float, slack_m: float, farthest: int) -> bool:
        """False where a voxel's number is beyond `farthest`; those clouds are not exact."""
        begin = self.start[chunk]
        cuts, whole = begin - begin[0], slice(begin[0], self.start[chunk.stop])
        far = np.zeros(len(cuts))
        for axis, points in enumerate(np.concatenate(self.points[chunk]).T.astype(np.float64, order="C")):
            self.low[chunk, axis] = np.minimum.reduceat(points, cuts)
            self.high[chunk, axis] = np.maximum.reduceat(points, cuts)
            points /= voxel_m
            voxel = np.floor(points)
            points -= voxel + 0.5
            off = np.maximum(np.maximum.reduceat(points, cuts), -np.minimum.reduceat(points, cuts))
            self.exact[chunk] &= off * voxel_m <= slack_m
            voxel -= self._origin[axis]
            ends = np.maximum(np.maximum.reduceat(voxel, cuts), -np.minimum.reduceat(voxel, cuts))
            far = np.maximum(far, ends)
            self.voxels[axis, whole] = np.clip(voxel, -farthest, farthest)
        self.exact[chunk] &= far <= farthest
        return bool((far <= farthest).all())

    def of(self, cloud: int) -> Array:
        """(3, k) voxel numbers of one cloud."""
        return self.voxels[:, self.start[cloud] : self.start[cloud + 1]]


class NearShares:
    """Shares of some of the clouds within `radius_m` of one of them."""

    def __init__(self, clouds: Sequence[Array], radius_m: float, voxel_m: float) -> None:
        self._ball = voxel_ball(radius_m, voxel_m)
        self.clouds, self._reach_m = VoxelClouds(clouds, voxel_m, self._ball.slack_m), radius_m + ROUNDING_M

    def shares(self, of: Array, near: int) -> Array:
        """(k,) float64: the share of each cloud of (k,) `of` within r of the cloud `near`."""
        voxels = self.clouds.of(near)
        low = voxels.min(axis=1, keepdims=True) - self._ball.reach
        sides = (voxels.max(axis=1, keepdims=True) - low).astype(np.int64) + self._ball.reach + 1
        gridded = self.clouds.exact[of] & self.clouds.exact[near] & (sides.prod() <= MAX_CELLS)
        shares = np.empty(len(of))
        if gridded.any():
            shares[gridded] = self._on_grid(of[gridded], voxels - low, low, sides)
        if not gridded.all():
            shares[~gridded] = self._by_tree(of[~gridded], near)
        return shares

    def _on_grid(self, of: Array, voxels: Array, low: Array, sides: Array) -> Array:
        grown = self._ball.grown(_flat(voxels, sides), sides[:, 0])
        at = np.concatenate([self.clouds.of(cloud) for cloud in of.tolist()], axis=1)
        at -= low
        within = at.view(f"u{at.itemsize}") < sides.astype(f"u{at.itemsize}")  # below 0 is beyond every side
        hit = grown.take(_flat(at, sides), mode="clip")
        hit &= within[0] & within[1] & within[2]
        sizes = self.clouds.size[of]
        return np.add.reduceat(hit, np.cumsum(sizes) - sizes, dtype=np.int64) / sizes

    def _by_tree(self, of: Array, near: int) -> Array:
        from scipy.spatial import cKDTree

        points = self.clouds.points[near]
        tree = cKDTree(points, balanced_tree=False, compact_nodes=False)
        low = points.min(axis=0).astype(np.float64) - self._reach_m
        high = points.max(axis=0).astype(np.float64) + self._reach_m
        shares = []
        for cloud in (self.clouds.points[i] for i in of.tolist()):
            inside = cloud[((cloud >= low) & (cloud <= high)).all(axis=1)]
            distance_m, _ = tree.query(inside, distance_upper_bound=self._reach_m)
            shares.append(np.isfinite(distance_m).sum() / len(cloud))
        return np.array(shares)


def _flat(voxels: Array, sides: Array) -> Array:
    """(k,) int32 cells of (3, k) voxels in a grid of (3, 1) sides; what lies outside the grid may wrap."""
    flat = voxels[0] * np.int32(sides[1, 0] * sides[2, 0])
    flat += voxels[1] * np.int32(sides[2, 0])
    flat += voxels[2]
    return flat
