from __future__ import annotations

from itertools import pairwise

import numpy as np

from openbelief.passages import passages

CELL_M = 0.1


def rooms(corridor_m=1.5, wall=1, above=3):
    """9 x 4 m of rooms, a corridor below them, and one more room below that; walls between them."""
    labels = np.zeros((100, 92), int)
    edges = np.linspace(1, 91, above + 1).astype(int)
    for k, (left, right) in enumerate(pairwise(edges)):
        labels[1:41, left + wall : right] = k + 3
    bottom = 41 + wall + round(corridor_m / CELL_M)
    labels[41 + wall : bottom, 2:91] = 1
    labels[bottom + wall : 99, 2:91] = 2
    return labels, above + 2


def test_what_is_long_narrow_and_beside_several_rooms_is_a_passage():
    assert passages(*rooms(), CELL_M).tolist() == [True, False, False, False, False]
    assert not passages(*rooms(corridor_m=4.0), CELL_M).any()


def test_a_bend_or_a_bay_leaves_it_one():
    labels, count = rooms()
    labels[42:57, 80:91] = 1
    labels[57:95, 78:91] = 1  # it turns down
    labels[40:42, 20:26] = 1  # a doorway
    assert passages(labels, count, CELL_M)[0]


def test_a_narrow_room_at_the_edge_leads_nowhere():
    assert not passages(*rooms(above=1), CELL_M).any()
    assert passages(np.zeros((5, 5), int), 0, CELL_M).tolist() == []


def test_walls_may_be_thick_and_unknown_within():
    assert passages(*rooms(wall=3), CELL_M)[0]
    assert not passages(*rooms(wall=8), CELL_M)[0]
