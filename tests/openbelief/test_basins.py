from __future__ import annotations

import numpy as np

from openbelief.basins import divided

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
