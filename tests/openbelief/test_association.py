from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from openbelief import Observation, Parameters, associate, overlap
from openbelief.association import Association, extent_alarms

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
    association = Association(Parameters())
    for i in order:
        association.add(views[i])
    assert association.labels().tolist() == [batch[i] for i in order]


@given(st.integers(0, 10_000))
@settings(max_examples=15, deadline=None)
def test_components_are_those_of_the_relation_checked_pair_by_pair(seed):
    views, p = random_views(seed, 12), Parameters()
    reach = np.eye(len(views), dtype=bool)
    for i, a in enumerate(views):
        for j, b in enumerate(views):
            alike = float(a.feature @ b.feature) >= p.tau_v
            reach[i, j] |= alike and overlap(a.points, b.points, p.radius_m) >= p.tau_g
    for _ in views:
        reach = reach @ reach
    assert partition(associate(views, p)) == {frozenset(np.flatnonzero(row).tolist()) for row in reach}


def test_an_object_too_long_is_reported_and_not_split():
    small = GRID[GRID[:, 0] < 0.05]
    views = [seen(small + np.float32([0.1 * k, 0, 0]), mask=k) for k in range(50)]
    labels = associate(views, Parameters(radius_m=0.11))
    assert len(partition(labels)) == 1
    (alarm,) = extent_alarms(views, labels, Parameters())
    assert alarm.label == 0 and alarm.extent_m == pytest.approx(4.9) and "over 4 m" in alarm.because


class Counted(Association):
    """Counts the expensive part: point-by-point comparisons."""

    comparisons = 0

    def _overlaps(self, one, other):
        self.comparisons += 1
        return super()._overlaps(one, other)


def test_comparisons_grow_with_the_site_and_not_with_its_square():
    def comparisons(n):
        association = Counted(Parameters())
        for i in range(n):
            association.add(seen(GRID + np.float32([3.0 * (i // 8), 0, 0]), frame=i))
        assert len(partition(association.labels())) == n // 8
        return association.comparisons

    assert 0 < comparisons(384) == 8 * comparisons(48)
