"""Plain yardsticks: the textbook's way to the same answers, with scipy where a textbook would use it."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array
from openbelief.backprojection import occupied_voxels
from openbelief.observation import Observation
from openbelief.parameters import Parameters
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid, reach

ROUNDING = 1e-6


def associate(observations: list[Observation], parameters: Parameters) -> list[int]:
    """Sweep along x, a kd-tree for each cloud, union-find; a pair of one component already is not compared."""
    from scipy.spatial import cKDTree

    reach_m = parameters.radius_m + ROUNDING
    low = np.array([o.points.min(axis=0) for o in observations])
    high = np.array([o.points.max(axis=0) for o in observations]) + reach_m
    features, trees = np.array([o.feature for o in observations]), [cKDTree(o.points) for o in observations]
    parent = list(range(len(observations)))

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = i = parent[parent[i]]
        return i

    def share(of: int, near: int) -> float:
        distance_m, _ = trees[near].query(observations[of].points, distance_upper_bound=reach_m)
        return float(np.isfinite(distance_m).mean())

    active: list[int] = []
    for i in np.argsort(low[:, 0], kind="stable").tolist():
        active = [j for j in active if high[j, 0] >= low[i, 0]]
        for j in active:
            if (low[j] > high[i]).any() or (low[i] > high[j]).any() or root(i) == root(j):
                continue
            if features[i] @ features[j] >= parameters.tau_v - ROUNDING and (
                share(i, j) >= parameters.tau_g or share(j, i) >= parameters.tau_g
            ):
                parent[root(i)] = root(j)
        active.append(i)
    return [root(i) for i in range(len(observations))]


def largest_cluster(points: Array, parameters: Parameters) -> Array:
    """DBSCAN over occupied voxels: all pairs within eps by a kd-tree, then connected components."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    voxels = occupied_voxels(points, parameters.voxel_m)
    counts, count = voxels.counts, len(voxels.counts)
    steps = (parameters.cluster_eps_m + ROUNDING) / parameters.voxel_m
    pairs = cKDTree(voxels.steps.T).query_pairs(steps, output_type="ndarray")
    one, other = np.concatenate((pairs, pairs[:, ::-1])).T
    density = counts + np.bincount(one, weights=counts[other], minlength=count)
    core = density >= parameters.cluster_min_points
    joined = core[one] & core[other]
    graph = coo_array((np.ones(joined.sum(), bool), (one[joined], other[joined])), shape=(count, count))
    labels = np.where(core, connected_components(graph, directed=False)[1], count)
    border = core[other] & ~core[one]
    voxel, label = np.unique(np.stack((one[border], labels[other[border]])), axis=1)
    sizes = np.bincount(labels[core], weights=counts[core], minlength=count)
    sizes += np.bincount(label, weights=counts[voxel], minlength=count)
    winner = labels[core][np.argmax(sizes[labels[core]])] if core.any() else -1
    inside = labels == winner
    inside[voxel[label == winner]] = True
    return voxels.centres(inside)


def way_lengths_m(grid: OccupancyGrid, radius_m: float, robot: Pose2) -> Array:
    """(h, w) metres to every cell: the whole grid inflated, and Dijkstra's algorithm over all of it."""
    return reach(grid.inflated(radius_m), robot.xy).distance_m
