from __future__ import annotations

import numpy as np
import pytest

from openbelief.basins import _rooted, divided

CELL_M = 0.05


def chambers(neck_m, second_m=4.0):
    """4 x 3 m of floor, and beside it so much more, joined by 0.5 m of a passage that is as wide as told."""
    floor = np.zeros((64, 92 + round(second_m / CELL_M)), bool)
    floor[2:62, 2:82] = True
    floor[2:62, 92:-2] = True
    half = round(neck_m / CELL_M / 2)
    floor[32 - half : 32 + half, 82:92] = True
    return floor


def test_a_narrow_passage_divides_and_a_wide_one_does_not():
    for neck_m, rooms in ((0.8, 2), (1.2, 2), (2.8, 1)):
        labels = divided(chambers(neck_m), CELL_M)
        assert len(np.unique(labels[labels > 0])) == rooms, neck_m


def test_the_border_runs_through_the_passage():
    floor = chambers(0.8)
    labels = divided(floor, CELL_M)
    assert (labels > 0).sum() == floor.sum()
    for side in (labels[2:62, 2:82], labels[2:62, 92:-2]):
        assert len(np.unique(side)) == 1


def test_a_corner_that_is_too_small_for_a_room_is_part_of_the_one_it_opens_to():
    labels = divided(chambers(0.8, second_m=1.8), CELL_M)
    assert len(np.unique(labels[labels > 0])) == 1


def test_floor_that_nothing_joins_is_two_rooms_and_a_speck_is_of_the_nearest():
    floor = chambers(0.0)
    floor[30:34, 84:86] = True
    labels = divided(floor, CELL_M)
    assert len(np.unique(labels[labels > 0])) == 2
    assert (labels[30:34, 84:86] == labels[32, 40]).all()
    assert not divided(np.zeros((8, 8), bool), CELL_M).any()


@pytest.mark.parametrize("seed", range(20))
def test_every_node_comes_to_the_root_of_its_least_spanning_tree(seed):
    """scipy's forest, with one more node that all roots hang on, says the same."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

    rng = np.random.default_rng(seed)
    count = 60
    ends = np.unique(np.sort(rng.integers(0, count, (2, 70)), axis=0), axis=1)
    ends = rng.permutation(ends[:, ends[0] != ends[1]], axis=1)
    roots = rng.permutation(count)[:5]
    spring = np.stack((np.full(5, count), roots))
    costs = np.concatenate((np.arange(ends.shape[1]) + 2.0, np.ones(5)))
    graph = coo_array((costs, np.concatenate((ends, spring), axis=1)), shape=(count + 1,) * 2).tocsr()
    tree = connected_components(minimum_spanning_tree(graph)[:count, :count], directed=False)[1]
    found = _rooted(ends, np.isin(np.arange(count), roots))
    for node in range(count):
        of_tree = [root for root in roots if tree[root] == tree[node]]
        assert [found[node]] == of_tree if of_tree else found[node] not in roots
