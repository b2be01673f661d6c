from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from openbelief import Observation, Parameters, associate, association, overlap
from openbelief.association import extent_alarms
from openbelief.backprojection import snap
from openbelief.voxel_share import NearShares

GRID = (np.stack(np.meshgrid(*[np.arange(5)] * 3), axis=-1).reshape(-1, 3) * 0.1).astype(np.float32)


def seen(points, feature=(1.0, 0.0), frame=0, mask=0):
    return Observation(frame, mask, None, 0.9, np.asarray(points, np.float32), np.asarray(feature, np.float32))


def partition(labels):
    return {frozenset(np.flatnonzero(labels == label).tolist()) for label in np.unique(labels)}


def random_views(seed: int, n: int = 24) -> list[Observation]:
    rng = np.random.default_rng(seed)
    views = []
    for i in range(n):
        side = rng.integers(2, 6)
        at = np.round(rng.uniform(0, 0.6, 3) / 0.1) * 0.1
        angle = rng.choice([0.0, 0.3, 0.6])
        views.append(seen(GRID[: side**3] + at, (np.cos(angle), np.sin(angle)), frame=i // 3, mask=i % 3))
    return views


def test_overlap_is_the_larger_of_the_two_shares():
    part = GRID[:25]
    assert overlap(part, GRID, 0.03) == 1.0
    assert overlap(GRID, part, 0.03) == 1.0
    assert overlap(GRID, GRID + np.float32(10), 0.03) == 0.0
    half = np.concatenate([GRID[:20], GRID[:20] + np.float32(5)])
    far = np.concatenate([GRID[:20], GRID[:60] + np.float32(9)])
    assert overlap(half, far, 0.03) == 0.5


def test_points_exactly_a_radius_apart_are_near():
    assert overlap(np.array([[0.5, 0, 0]]), np.array([[0.53, 0, 0]]), 0.03) == 1.0
    assert overlap(np.array([[0.5, 0, 0]]), np.array([[0.531, 0, 0]]), 0.03) == 0.0


@given(st.integers(0, 10_000), st.floats(0.01, 0.2))
@settings(max_examples=30, deadline=None)
def test_overlap_is_symmetric_and_a_share(seed, radius):
    rng = np.random.default_rng(seed)
    P, Q = rng.uniform(0, 1, (rng.integers(1, 60), 3)), rng.uniform(0, 1, (rng.integers(1, 60), 3))
    assert overlap(P, Q, radius) == overlap(Q, P, radius)
    assert 0.0 <= overlap(P, Q, radius) <= 1.0


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.zeros((3, 2)), np.array([[0, 0, np.nan]])])
def test_overlap_refuses_points_that_are_none(points):
    with pytest.raises(ValueError, match="P"):
        overlap(points, GRID, 0.03)


@pytest.mark.parametrize("radius", [0.0, -1.0, np.nan, np.inf, "0.03", None])
def test_overlap_refuses_a_radius_that_is_none(radius):
    with pytest.raises(ValueError, match="radius"):
        overlap(GRID, GRID, radius)


def test_things_that_look_unlike_are_not_one_object_however_they_overlap():
    assert partition(associate([seen(GRID), seen(GRID, (0, 1), mask=1)], Parameters())) == {
        frozenset({0}),
        frozenset({1}),
    }


def test_a_chain_of_overlaps_is_one_object():
    views = [seen(GRID[25 * k : 25 * k + 50], mask=k) for k in range(4)]
    assert len(partition(associate(views, Parameters(tau_g=0.5)))) == 1


def test_repeated_frame_and_mask_are_accepted():
    assert associate([seen(GRID), seen(GRID), seen(GRID + np.float32(9))], Parameters()).tolist() == [0, 0, 1]


def test_repeats_of_a_frame_and_mask_have_their_numbers_whatever_the_order():
    views = [seen(GRID + np.float32(9 * k)) for k in range(4)]
    labels = associate(views, Parameters()).tolist()
    assert sorted(labels) == [0, 1, 2, 3]
    assert associate(views[::-1], Parameters()).tolist() == labels[::-1]


def test_components_are_numbered_by_their_smallest_key():
    views = [seen(GRID, frame=7), seen(GRID + np.float32(9), frame=3), seen(GRID, frame=9)]
    assert associate(views, Parameters()).tolist() == [1, 0, 1]


def test_nothing_gives_no_labels():
    assert associate([], Parameters()).shape == (0,)


def test_features_of_unlike_length_are_refused():
    with pytest.raises(ValueError, match="2 numbers"):
        associate([seen(GRID), seen(GRID, (1, 0, 0), mask=1)], Parameters())


@given(st.integers(0, 10_000), st.randoms(use_true_random=False))
@settings(max_examples=25, deadline=None)
def test_any_order_of_mapping_gives_the_same_objects_as_all_at_once(seed, random):
    views = random_views(seed)
    batch = associate(views, Parameters())
    order = list(range(len(views)))
    random.shuffle(order)
    assert associate([views[i] for i in order], Parameters()).tolist() == [batch[i] for i in order]


def related(a: Observation, b: Observation, p: Parameters) -> bool:
    """eq. association read off the page: every distance, in float64."""
    if a.feature.astype(np.float64) @ b.feature.astype(np.float64) < p.tau_v - 1e-6:
        return False
    near = cdist(a.points.astype(np.float64), b.points.astype(np.float64)) <= p.radius_m + 1e-6
    return max(near.any(axis=1).mean(), near.any(axis=0).mean()) >= p.tau_g


def components(views: list[Observation], p: Parameters) -> set[frozenset[int]]:
    reached = np.array([[a is b or related(a, b, p) for b in views] for a in views])
    for _ in range(len(views).bit_length()):
        reached = reached @ reached
    return {frozenset(np.flatnonzero(row).tolist()) for row in reached}


SHAPES = {  # points of a thing, metres; a lattice of steps that are exactly r apart is the hardest
    "blob": lambda rng, n: rng.normal(0, 0.05, (n, 3)),
    "edge": lambda rng, n: np.column_stack((rng.uniform(0, 0.6, n), np.zeros((n, 2)))),
    "wall": lambda rng, n: np.column_stack((rng.uniform(0, 6, n), np.zeros(n), rng.uniform(0, 2.5, n))),
    "steps of r": lambda rng, n: rng.integers(0, 4, (n, 3)) * 0.03,
    "steps of a voxel": lambda rng, n: rng.integers(0, 6, (n, 3)) * 0.02,
    "point": lambda rng, n: np.zeros((1, 3)),
}
KEPT = {  # how a caller's points lie: on the centres of voxels, as computed in float32, beside them, anywhere
    "snapped": lambda rng, points: snap(points, 0.02),
    "float32": lambda rng, points: np.floor(points / 0.02).astype(np.float32) * np.float32(0.02) + np.float32(0.01),
    "nearly": lambda rng, points: snap(points, 0.02) + rng.uniform(-1, 1, 3) * rng.choice([0.0002, 0.0006, 0.001]),
    "raw": lambda rng, points: points,
}


def adversarial_views(rng: np.random.Generator, origin: np.ndarray, kept: list[str]) -> list[Observation]:
    """Parts, unions and shifts of a few things that lie in each other; frames and masks are repeated."""
    names = list(SHAPES)
    things = [
        SHAPES[names[rng.integers(len(names))]](rng, rng.integers(1, 100)) + rng.uniform(-0.3, 0.3, 3) for _ in range(3)
    ]
    looks = rng.normal(size=(2, 8))
    views = []
    for k in range(int(rng.integers(2, 16))):
        points = things[rng.integers(3)]
        points = points[rng.random(len(points)) <= rng.choice([0.4, 0.8, 1.0])]
        if not len(points) or rng.random() < 0.2:
            points = np.concatenate((points, things[rng.integers(3)]))
        points = points + rng.choice([0, 0.01, 0.02, 0.03]) * rng.integers(-1, 2, 3) + origin
        feature = looks[rng.integers(2)] + rng.normal(size=8) * rng.choice([0, 0.05, 0.3])
        points = KEPT[kept[rng.integers(len(kept))]](rng, points)
        views.append(seen(points, feature / np.linalg.norm(feature), frame=k // 4, mask=k % 2))
    return views


@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([["snapped"], ["float32"], ["nearly"], ["raw"], list(KEPT)]),
    st.sampled_from([0.0, 9.99, -350.0, 1e4, 1e6]),
    st.sampled_from([0.75, 1.0, 0.5, 0.01]),
    st.sampled_from([0.03, 0.02, 0.04, 0.0283, 0.011, 0.15]),
    st.sampled_from([0.85, -1.0]),
)
@settings(max_examples=150, deadline=None)
def test_components_are_those_of_the_relation_checked_pair_by_pair(seed, kept, origin_m, tau_g, radius_m, tau_v):
    rng = np.random.default_rng(seed)
    views = adversarial_views(rng, origin_m * rng.choice([-1, 0, 1], 3), kept)
    p = Parameters(tau_g=tau_g, radius_m=radius_m, tau_v=tau_v)
    assert partition(associate(views, p)) == components(views, p)


def test_a_site_wider_than_the_short_numbers_of_its_voxels_is_one_site():
    views = [seen(snap(GRID + np.float32([at, 0, 0]), 0.02), mask=k) for k, at in enumerate((0, 400, 400, 0))]
    assert partition(associate(views, Parameters())) == {frozenset({0, 3}), frozenset({1, 2})}


def test_beyond_all_numbers_of_voxels_the_points_decide():
    ends, between = [[3e9, 0, 0], [3e9 + 1024, 0, 0]], [[3e9 + 512, 0, 0]]
    views = [seen(GRID), seen(ends, mask=1), seen(between, mask=2), seen(ends, mask=3)]
    assert partition(associate(views, Parameters())) == {frozenset({0}), frozenset({1, 3}), frozenset({2})}


def test_an_object_too_long_is_reported_and_not_split():
    small = GRID[GRID[:, 0] < 0.05]
    views = [seen(small + np.float32([0.1 * k, 0, 0]), mask=k) for k in range(50)]
    labels = associate(views, Parameters(radius_m=0.11))
    assert len(partition(labels)) == 1
    (alarm,) = extent_alarms(views, labels, Parameters())
    assert alarm.label == 0 and alarm.extent_m == pytest.approx(4.9) and "over 4 m" in alarm.because


def test_comparisons_grow_with_the_site_and_not_with_its_square(monkeypatch):
    compared = []

    class Counted(NearShares):
        def shares(self, of, near):
            compared.append(len(of))
            return super().shares(of, near)

    def comparisons(n):
        compared.clear()
        views = [seen(GRID + np.float32([3.0 * (i // 8), 0, 0]), frame=i) for i in range(n)]
        assert len(partition(associate(views, Parameters()))) == n // 8
        return sum(compared)

    monkeypatch.setattr(association, "NearShares", Counted)
    assert 0 < comparisons(384) == 8 * comparisons(48)
