"""The largest DBSCAN cluster of a mask's points, on voxels: flying pixels, and what the mask bled onto, stay out."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from openbelief.arrays import Array
from openbelief.backprojection import Voxels, occupied_voxels
from openbelief.parameters import Parameters
from openbelief.voxel_grid import Grid, table

ROUNDING_M = 1e-6  # voxels exactly eps apart are neighbours, wherever the origin of the map lies
FACES = np.concatenate((np.eye(3, dtype=np.int64), -np.eye(3, dtype=np.int64)))
MAX_REACH = 40  # voxels: more than 250 000 would lie around each
FIRST_LOOK = 8  # this part of the ball shows most dense voxels to be dense


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
    """What eps is on voxels. ball: (b, 3) steps to all voxels within eps, the nearest first.

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
    steps = steps[np.argsort((steps**2).sum(axis=1), kind="stable")]
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
        cells, self._cube = _distinct(coarse.flat(cubes))
        self._cubes = stack.enter_context(table(coarse, cells))
        self._ball, self._shell = grid.flat_steps(reach.ball), coarse.flat_steps(reach.shell)
        self._cubes.fill(np.arange(1, len(cells) + 1))
        beside = list(self._cubes.around(slice(None), coarse.flat_steps(reach.faces)))
        self._beside = np.concatenate([np.zeros((0, len(cells)), np.int32), *beside]).T  # (c, f), from 1, 0 for none

    def core(self, min_points: int) -> Array:
        """(k,) bool: at least so many points within eps of a voxel, its own included."""
        dense = self._points_at_least() >= min_points
        core = dense[self._cube]
        self._voxels.fill(self._counts)
        left, first = np.flatnonzero(~core), len(self._ball) // FIRST_LOOK
        points = np.zeros(len(left), np.int64)
        for steps in (self._ball[:first], self._ball[first:]):
            for held in self._voxels.around(left, steps):
                points += held.sum(axis=0)
            core[left] = points >= min_points
            left, points = left[points < min_points], points[points < min_points]
        return core

    def _points_at_least(self) -> Array:
        """(c,) points in each cube and in those that share a face with it: so many are within eps of all its voxels."""
        points = np.bincount(self._cube + 1, weights=self._counts)
        least: Array = points[1:] + points[self._beside].sum(axis=1)
        return least

    def clusters(self, core: Array) -> Array:
        """(k,) int cluster of each core voxel, from 1; 0 of the others."""
        joined = self._joined_by_faces(core)
        first = len(self._ball) // FIRST_LOOK
        for ball in (self._ball[:first], self._ball[first:]):  # the nearest steps join most of what is to be joined
            largest = int(np.argmax(np.bincount(joined[joined > 0], minlength=1)))
            if not ((joined > 0) & (joined != largest)).any():
                break
            voxels = np.flatnonzero(core & self._maybe_joined(joined, largest)[self._cube])
            joined = self._joined_across_gaps(voxels, np.where(core, joined[self._cube], 0), ball)[joined]
        return np.where(core, joined[self._cube], 0)

    def _joined_by_faces(self, core: Array) -> Array:
        """(c,) int from 1: equal where a way over the faces of cubes with a core voxel leads from one to the other."""
        held = np.zeros(len(self._beside) + 1, bool)
        held[self._cube[core] + 1] = True
        one, face = np.nonzero(held[1:, None] & held[self._beside])
        joined = _components(len(self._beside), one, self._beside[one, face] - 1) + 1
        return joined * held[1:]

    def _maybe_joined(self, joined: Array, largest: int) -> Array:
        """(c,) bool: cubes, of all clusters but the largest, that have another cluster's cube in their shell."""
        cubes = np.flatnonzero((joined > 0) & (joined != largest))
        self._cubes.fill(joined)
        maybe = np.zeros(len(joined), bool)
        for other in self._cubes.around(cubes, self._shell):
            maybe[cubes] |= ((other > 0) & (other != joined[cubes])).any(axis=0)
        return maybe

    def _joined_across_gaps(self, voxels: Array, clusters: Array, ball: Array) -> Array:
        """(n + 1,) the number of each cluster, joined where a step from one of these voxels leads to another's."""
        self._voxels.fill(clusters)
        many, pairs = int(clusters.max()) + 1, set[int]()
        for other in self._voxels.around(voxels, ball):
            step, one = np.nonzero((other > 0) & (other != clusters[voxels]))
            pairs.update((clusters[voxels[one]] * many + other[step, one]).tolist())
        return _merged(many, (divmod(pair, many) for pair in pairs))

    def largest(self, core: Array, clusters: Array) -> Array:
        """(k,) bool: the voxels of the cluster with most points, its border's too."""
        voxel, cluster = self._border(core, clusters)
        sizes = np.bincount(clusters, weights=self._counts * core)
        sizes += np.bincount(cluster, weights=self._counts[voxel], minlength=len(sizes))
        winner = clusters[core][np.argmax(sizes[clusters[core]])]
        inside = clusters == winner
        inside[voxel[cluster == winner]] = True
        return inside

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


def _distinct(numbers: Array) -> tuple[Array, Array]:
    """Each of (k,) numbers once, ascending, and (k,) which of them each is; they are sorted in parts already."""
    order = np.argsort(numbers, kind="stable")
    ascending = numbers[order]
    new = np.concatenate(([True], ascending[1:] != ascending[:-1]))
    which = np.empty(len(numbers), np.int64)
    which[order] = np.cumsum(new) - 1
    return ascending[new], which


def _components(count: int, one: Array, other: Array) -> Array:
    """(count,) component of each node under edges from `one`, ascending, to `other`, and back."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    starts = np.zeros(count + 1, np.int32)
    np.cumsum(np.bincount(one, minlength=count), out=starts[1:])
    graph = csr_array((np.ones(len(one)), other.astype(np.int32), starts), shape=(count, count))
    labels: Array = connected_components(graph, directed=True, connection="strong")[1]  # no transpose
    return labels


def _merged(count: int, pairs: Iterable[tuple[int, int]]) -> Array:
    """(count,) number that stands for each number and all that are paired with it."""
    parent = list(range(count))

    def root(number: int) -> int:
        while parent[number] != number:
            parent[number] = number = parent[parent[number]]
        return number

    for one, other in pairs:
        parent[root(one)] = root(other)
    return np.array([root(number) for number in range(count)])
