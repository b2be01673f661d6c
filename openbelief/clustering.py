"""The largest DBSCAN cluster of a mask's points, on voxels: flying pixels, and what the mask bled onto, stay out."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from openbelief.arrays import Array
from openbelief.backprojection import Voxels, occupied_voxels, runs
from openbelief.parameters import Parameters
from openbelief.voxel_grid import Grid, table

ROUNDING_M = 1e-6  # voxels exactly eps apart are neighbours, wherever the origin of the map lies
FACES = np.concatenate((np.eye(3, dtype=np.int64), -np.eye(3, dtype=np.int64)))
MAX_REACH = 40  # voxels: more than 250 000 would lie around each


def largest_cluster(points: Array, parameters: Parameters) -> Array:
    """(k, 3) float32 voxel centres of the largest DBSCAN cluster of (n, 3) points; k = 0 where all is noise.

    Distances are taken between the centres of occupied voxels and densities counted in points: with eps = 4 voxels
    this differs from DBSCAN over every point by less than a voxel. Core voxels within eps of each other are one
    cluster; a voxel that is not core belongs to each cluster that has one within eps. The largest has most points; of
    equals, the first core voxel. Raises ValueError where voxel_m is too small for the points, or for eps.
    """
    voxels = occupied_voxels(points, parameters.voxel_m)
    if not len(voxels.counts):
        return voxels.centres()
    reach = reach_of(parameters.cluster_eps_m, parameters.voxel_m)
    with ExitStack() as stack:
        near = _Near(voxels, reach, stack)
        core = near.core(parameters.cluster_min_points)
        return voxels.centres(near.largest(core, near.clusters(core))) if core.any() else voxels.centres(core)


@dataclass(frozen=True)
class Neighbourhood:
    """What eps is on voxels. ball: (b, 3) steps to all voxels within eps.

    side: of cubes, in voxels, all of whose voxels are within eps of each other and of those in cubes that are one of
    (f, 3) `faces` away: such cubes decide without a look at their voxels. shell: (c, 3) steps to all cubes that may
    hold a voxel within eps.
    """

    ball: Array
    side: int
    faces: Array
    shell: Array


@lru_cache(maxsize=16)
def reach_of(eps_m: float, voxel_m: float) -> Neighbourhood:
    squared = ((eps_m + ROUNDING_M) / voxel_m) ** 2
    most = int(np.sqrt(squared)) + 1
    if most > MAX_REACH:
        raise ValueError(f"cluster_eps_m is more than {MAX_REACH} times voxel_m")
    steps = np.stack(np.meshgrid(*[np.arange(-most, most + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    sides = [side for side in range(1, most + 1) if (2 * side - 1) ** 2 + 2 * (side - 1) ** 2 <= squared]
    side = max(sides, default=1)
    least = np.maximum(side * np.abs(steps) - (side - 1), 0)  # voxels along each axis from cube to cube
    ball, shell = (steps[(apart**2).sum(axis=1) <= squared] for apart in (steps, least))
    return Neighbourhood(ball, side, FACES[: 6 * bool(sides)], shell)


class _Near:
    """What lies around the voxels of one mask, and around the cubes that they fill."""

    def __init__(self, voxels: Voxels, reach: Neighbourhood, stack: ExitStack) -> None:
        self._counts, cubes = voxels.counts, voxels.steps // reach.side
        grid, coarse = Grid(voxels.steps, reach.ball), Grid(cubes, reach.shell)
        self._voxels = stack.enter_context(table(grid, grid.flat(voxels.steps)))
        cells = coarse.flat(cubes)
        distinct, _ = runs(np.sort(cells))
        self._cubes = stack.enter_context(table(coarse, distinct))
        self._ball, self._shell = grid.flat_steps(reach.ball), coarse.flat_steps(reach.shell)
        self._cubes.fill(np.arange(1, len(distinct) + 1))
        self._cube = self._cubes.at(cells) - 1
        self._beside = self._cubes.at(coarse.flat_steps(reach.faces)[:, None] + distinct)  # (f, c), from 1, 0 for none

    def core(self, min_points: int) -> Array:
        """(k,) bool: at least so many points within eps of a voxel, its own included."""
        core = (self._points_at_least() >= min_points)[self._cube]
        self._voxels.fill(self._counts)
        left = np.flatnonzero(~core)
        core[left] = sum(held.sum(axis=0) for held in self._voxels.around(left, self._ball)) >= min_points
        return core

    def _points_at_least(self) -> Array:
        """(c,) points in each cube and in those that share a face with it: so many are within eps of all its voxels."""
        points = np.bincount(self._cube + 1, weights=self._counts)
        least: Array = points[1:] + points[self._beside].sum(axis=0)
        return least

    def clusters(self, core: Array) -> Array:
        """(k,) int cluster of each core voxel, from 1; 0 of the others."""
        joined = self._joined_by_faces(core)
        maybe = self._maybe_joined(joined)
        if maybe.any():
            voxels = np.flatnonzero(core & maybe[self._cube])
            joined = self._joined_across_gaps(voxels, joined[self._cube] * core)[joined]
        return joined[self._cube] * core

    def _joined_by_faces(self, core: Array) -> Array:
        """(c,) int from 1: equal where a way over the faces of cubes with a core voxel leads from one to the other."""
        held = np.zeros(self._beside.shape[1] + 1, bool)
        held[self._cube[core] + 1] = True
        below = self._beside[3:]  # each face once
        both = np.flatnonzero(held[1:] & held[below])
        joined = _components(below.shape[1], both % below.shape[1], below.take(both) - 1) + 1
        return joined * held[1:]

    def _maybe_joined(self, joined: Array) -> Array:
        """(c,) bool: cubes, of all clusters but the one with most, that have another cluster's cube in their shell."""
        most = np.argmax(np.bincount(joined)[1:]) + 1
        cubes = np.flatnonzero((joined > 0) & (joined != most))
        self._cubes.fill(joined)
        own, maybe = joined[cubes], np.zeros(len(joined), bool)
        for other in self._cubes.around(cubes, self._shell):
            maybe[cubes] |= ((other > 0) & (other != own)).any(axis=0)
        return maybe

    def _joined_across_gaps(self, voxels: Array, clusters: Array) -> Array:
        """(n + 1,) the number of each cluster, joined where a step from one of these voxels leads to another's."""
        self._voxels.fill(clusters)
        own, ones, others = clusters[voxels], [], []
        for other in self._voxels.around(voxels, self._ball):
            apart = np.flatnonzero((other > 0) & (other != own))
            ones.append(own[apart % len(own)])
            others.append(other.take(apart))
        return _components(int(clusters.max()) + 1, np.concatenate(ones), np.concatenate(others))

    def largest(self, core: Array, clusters: Array) -> Array:
        """(k,) bool: the voxels of the cluster with most points, its border's too."""
        inside = clusters == self._winner(core, clusters)
        self._voxels.fill(inside)
        left = np.flatnonzero(~core)
        for near in self._voxels.around(left, self._ball):
            inside[left] |= near.any(axis=0)
        return inside

    def _winner(self, core: Array, clusters: Array) -> int:
        """The cluster with most points, its border's too; of equals, that of the first core voxel."""
        sizes = np.bincount(clusters, weights=self._counts * core)
        second, most = np.partition(sizes, -2)[-2:]
        if second + self._counts[~core].sum() < most:  # whatever its border may be
            return int(np.argmax(sizes))
        voxel, cluster = self._border(core, clusters)
        sizes += np.bincount(cluster, weights=self._counts[voxel], minlength=len(sizes))
        return int(clusters[core][np.argmax(sizes[clusters[core]])])

    def _border(self, core: Array, clusters: Array) -> tuple[Array, Array]:
        """Pairs, each once, of a voxel that is not core and a cluster that has a core voxel within eps of it."""
        voxels, many = np.flatnonzero(~core), int(clusters.max()) + 1
        self._voxels.fill(clusters)
        pairs = [np.zeros(0, np.int64)]
        for near in self._voxels.around(voxels, self._ball):
            step, one = np.nonzero(near)
            pairs.append(voxels[one] * many + near[step, one])
        voxel, cluster = np.divmod(np.unique(np.concatenate(pairs)), many)
        return voxel, cluster


def _components(count: int, one: Array, other: Array) -> Array:
    """(count,) the least node of each one's component under edges between `one` and `other`.

    Roots are hooked to the least root beside them and ways to roots cut short, until no edge leads from tree to tree:
    of any two rounds one joins every tree to another, so there are few (Shiloach and Vishkin, 1982).
    """
    root = np.arange(count)
    while len(one):
        np.minimum.at(root, np.maximum(one, other), np.minimum(one, other))
        while ((above := root[root]) != root).any():
            root = above
        one, other = root[one], root[other]
        apart = one != other
        one, other = one[apart], other[apart]
    return root
