"""What of a mask's points is the thing: the largest cluster, as DBSCAN over its voxels has it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import cdist

from openbelief import clustering, voxel_grid
from openbelief.backprojection import occupied_voxels
from openbelief.clustering import largest_cluster
from openbelief.parameters import Parameters

PARAMETERS = Parameters()


def dbscan(points: np.ndarray, p: Parameters) -> np.ndarray:
    """DBSCAN read off the page: every distance between voxels, in whole voxels."""
    voxels = occupied_voxels(points, p.voxel_m)
    near = cdist(voxels.steps.T, voxels.steps.T) * p.voxel_m <= p.cluster_eps_m + 1e-6
    core = near @ voxels.counts >= p.cluster_min_points
    left, clusters = list(np.flatnonzero(core)), []
    while left:
        cluster = np.zeros(len(core), bool)
        cluster[left[0]] = True
        while (grown := core & near[cluster].any(axis=0)).sum() > cluster.sum():
            cluster = grown
        left = [i for i in left if not cluster[i]]
        clusters.append(cluster | (~core & near[cluster].any(axis=0)))
    sizes = [voxels.counts[cluster].sum() for cluster in clusters]
    return voxels.centres(clusters[int(np.argmax(sizes))] if clusters else core)


def scattered(rng: np.random.Generator, n: int) -> np.ndarray:
    """Slanted sheets with noise, balls, and stray points, some of them just within and just out of reach."""
    parts = [rng.uniform(-0.4, 0.4, (n // 8 + 1, 3))]
    for _ in range(int(rng.integers(1, 5))):
        plane = rng.uniform(0, rng.uniform(0.05, 0.4), (n // 4 + 1, 2)) @ rng.normal(size=(2, 3))
        parts.append(plane + rng.normal(0, rng.choice([0, 0.002, 0.02]), plane.shape) + rng.uniform(-0.3, 0.3, 3))
    return np.concatenate(parts).astype(np.float32)


@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 500),
    st.sampled_from([0.08, 0.08, 0.02, 0.015, 0.04, 0.11, 0.16, 0.0283]),
    st.sampled_from([10, 1, 3, 40]),
    st.booleans(),
)
@settings(max_examples=150, deadline=None)
def test_the_largest_cluster_is_dbscans(seed, n, eps_m, min_points, far):
    rng = np.random.default_rng(seed)
    points = scattered(rng, n) + np.float32(far * rng.uniform(-50, 50, 3))
    p = Parameters(cluster_eps_m=eps_m, cluster_min_points=min_points)
    np.testing.assert_array_equal(largest_cluster(points, p), dbscan(points, p))


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.08, 0.02, 0.11]))
@settings(max_examples=30, deadline=None)
def test_a_grid_too_large_to_be_looked_into_gives_the_same(seed, eps_m):
    points, p = scattered(np.random.default_rng(seed), 300), Parameters(cluster_eps_m=eps_m)
    found = largest_cluster(points, p)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(voxel_grid, "DIRECT_CELLS", 0)
        np.testing.assert_array_equal(largest_cluster(points, p), found)
        patch.setattr(voxel_grid, "DIRECT_CELLS", 1 << 26)
        patch.setattr(voxel_grid, "KEPT_CELLS", 64)
        patch.setattr(voxel_grid, "_ROWS", voxel_grid._Rows())
        np.testing.assert_array_equal(largest_cluster(points, p), found)


@given(st.integers(0, 2**32 - 1), st.tuples(*[st.integers(-500, 500)] * 3))
@settings(max_examples=30, deadline=None)
def test_where_the_origin_of_the_map_lies_decides_nothing(seed, moved):
    """eps is exactly four voxels: without a margin the last bit of a coordinate would decide who is a neighbour."""
    rng = np.random.default_rng(seed)
    steps = rng.integers(0, 30, (400, 3))
    here = (steps + 0.5) * PARAMETERS.voxel_m
    there = here + np.array(moved) * PARAMETERS.voxel_m
    found = [largest_cluster(points.astype(np.float32), PARAMETERS) for points in (here, there)]
    kept = [np.rint(cluster / PARAMETERS.voxel_m - 0.5).astype(int) for cluster in found]
    np.testing.assert_array_equal(kept[0], kept[1] - np.array(moved))


def voxel_points(steps: list[tuple[int, int, int]], each: int) -> np.ndarray:
    return np.repeat((np.array(steps) + 0.5) * PARAMETERS.voxel_m, each, axis=0).astype(np.float32)


@pytest.mark.parametrize(("stray", "mirrored", "tens"), [(0, 1, False), (1, 1, False), (2, 1, True), (1, -1, True)])
def test_a_border_may_decide_and_of_equals_the_cluster_of_the_first_core_voxel_is_taken(stray, mirrored, tens):
    """11 core points against 10, 3 more within eps of both, and some within eps of the ten only."""
    held = {(-4, 0, 0): 8, (0, 0, 0): 3, (4, 0, 0): 3, (8, 0, 0): 3, (12, 0, 0): 7, (8, 4, 0): stray}
    points = np.concatenate([voxel_points([(mirrored * x, y, z)], n) for (x, y, z), n in held.items()])
    found = largest_cluster(points, PARAMETERS)
    np.testing.assert_array_equal(found, dbscan(points, PARAMETERS))
    assert (np.abs(found[:, 0]) > 0.2).any() == tens


@given(st.integers(0, 2**32 - 1), st.integers(2, 12), st.sampled_from([3, 4, 5, 8]))
@settings(max_examples=60, deadline=None)
def test_of_clusters_alike_the_one_of_the_first_core_voxel_is_taken(seed, sites, pitch):
    """Lattices at eps and past it: many clusters of the same points, and strays whose points count for several."""
    rng = np.random.default_rng(seed)
    steps = rng.integers(0, 4, (sites, 3)) * pitch
    points = np.concatenate((voxel_points(steps, 10), voxel_points(rng.integers(0, 4 * pitch, (sites, 3)), 2)))
    np.testing.assert_array_equal(largest_cluster(points, PARAMETERS), dbscan(points, PARAMETERS))


@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.floats(0, 2))
@settings(max_examples=100, deadline=None)
def test_components_are_those_of_the_graph(seed, count, degree):
    """Also paths and stars whose nodes are numbered at random: what a label would have to wander through."""
    rng = np.random.default_rng(seed)
    name = rng.permutation(count)
    path = name[np.stack((np.arange(count - 1), np.arange(1, count)))]
    star = name[np.stack((np.zeros(count - 1, int), np.arange(1, count)))]
    for one, other in (path, star, rng.integers(0, count, (2, int(count * degree)))):
        graph = coo_array((np.ones(len(one)), (one, other)), shape=(count, count))
        labels = connected_components(graph, directed=False)[1]
        least = [np.flatnonzero(labels == label)[0] for label in labels]
        np.testing.assert_array_equal(clustering._components(count, one, other), least)


def test_voxels_exactly_eps_apart_are_neighbours():
    apart = np.repeat([[0.01, 0.01, 0.01], [0.09, 0.01, 0.01], [0.17, 0.01, 0.01]], 10, axis=0).astype(np.float32)
    assert len(largest_cluster(apart, PARAMETERS)) == 3
    assert len(largest_cluster(apart * np.float32([1.25, 1, 1]), PARAMETERS)) == 1
    assert len(clustering.reach_of(0.3, 0.1).ball) == 123  # 0.3 / 0.1 is less than 3 in floating point


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_the_cluster_is_the_largest_group_that_no_step_of_eps_leaves(seed):
    rng = np.random.default_rng(seed)
    centres = np.array([[0, 0, 0], [1.0, 0, 0], [0, 1.0, 0]])
    sizes = rng.permutation([120, 250, 400])
    groups = [c + rng.uniform(-0.1, 0.1, (n, 3)) for c, n in zip(centres, sizes, strict=True)]
    noise = rng.uniform(2, 9, (6, 3))
    found = largest_cluster(np.concatenate([*groups, noise]).astype(np.float32), PARAMETERS)
    largest = centres[int(np.argmax(sizes))]
    assert len(found) and (np.abs(found - largest) <= 0.1 + PARAMETERS.voxel_m).all()


def test_points_that_are_all_apart_are_noise():
    apart = np.arange(30, dtype=np.float32)[:, None] * [1.0, 0, 0]
    assert largest_cluster(apart.astype(np.float32), PARAMETERS).shape == (0, 3)
    assert largest_cluster(np.zeros((0, 3), np.float32), PARAMETERS).shape == (0, 3)


def test_cubes_decide_only_where_all_their_voxels_are_within_eps():
    reach = clustering.reach_of(0.08, 0.02)
    assert (reach.side, len(reach.ball), len(reach.faces)) == (2, 257, 6)
    assert clustering.reach_of(0.01, 0.02).faces.shape == (0, 3)


@pytest.mark.parametrize(
    ("voxel_m", "eps_m", "reason"),
    [
        (1e-7, 1e-7, "voxel_m is too small for things of its size"),
        (0.001, 0.08, "cluster_eps_m is more than 40 times voxel_m"),
    ],
)
def test_what_is_too_fine_to_be_counted_is_refused_in_one_line(voxel_m, eps_m, reason):
    points = np.array([[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]], np.float32)
    with pytest.raises(ValueError, match=f"^{reason}$"):
        largest_cluster(points, Parameters(voxel_m=voxel_m, cluster_eps_m=eps_m))
