from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory
from openbelief.derived_rooms import with_derived_rooms
from openbelief.floors import floor_heights, floors_of
from openbelief.observation import Intrinsics
from openbelief.rooms import Room
from openbelief.scene_graph import scene_graph
from openbelief.surroundings import CameraView, StoreyMap, Surroundings, ViewImages, encode_depth
from openbelief.traversability import OccupancyGrid

CAMERA = Intrinsics(160, 120, 150.0, 150.0, 79.5, 59.5)


def looking_down(x, y, height, floor, recording="walk", stamp_ns=0):
    """A camera `height` above a floor that looks straight down on it."""
    pose = np.array([[1.0, 0, 0, x], [0, -1.0, 0, y], [0, 0, -1.0, floor + height], [0, 0, 0, 1]])
    depth = np.full((120, 160), height, np.float32)
    return CameraView(recording, stamp_ns, pose, CAMERA), ViewImages(encode_depth(depth), b"")


def site(poses, maps=()):
    views = [looking_down(*pose, stamp_ns=k) for k, pose in enumerate(poses)]
    images = {view.key: image for view, image in views}
    return Surroundings(tuple(view for view, _ in views), tuple(maps), images.__getitem__)


def test_two_storeys_are_found_at_their_heights():
    floors = floors_of(site([(0, 0, 1.2, 0.0), (1, 0, 1.2, 0.0), (0, 0, 1.25, 3.0)]), [])
    assert [(f.id, round(f.height_m, 2)) for f in floors] == [(0, 0.0), (1, 3.0)]
    assert floors[0].holds(2.2) and not floors[0].holds(2.9) and floors[1].holds(2.9) and floors[1].holds(5.0)


def test_a_table_top_is_no_floor_however_often_it_was_seen():
    for looks_at_table in (3000, 7000):
        z = np.concatenate((np.zeros(1000), np.full(looks_at_table, 0.72)))
        heights = floor_heights(z, np.full(len(z), 1.3), np.array([1.3]))
        assert len(heights) == 1 and abs(heights[0]) < 0.03


def test_a_wild_pose_is_no_floor():
    z = np.concatenate((np.zeros(1000), np.full(300, 1e12), np.full(300, -1e12)))
    assert [round(h, 1) for h in floor_heights(z, z + 1.3, np.array([1.3, 1e12, -1e12]))] == [0.0]


def test_reflections_below_a_floor_are_no_floor():
    z = np.concatenate((np.full(60, -0.7), np.zeros(1000)))
    heights = floor_heights(z, np.full(1060, 1.3), np.array([1.3]))
    assert len(heights) == 1 and abs(heights[0]) < 0.03


def test_a_floor_seen_from_a_gallery_but_never_walked_on_is_none():
    z = np.concatenate((np.full(500, -3.0), np.zeros(1000)))
    heights = floor_heights(z, np.full(1500, 1.3), np.array([1.3]))
    assert len(heights) == 1 and abs(heights[0]) < 0.03


def test_a_ceiling_is_no_floor():
    z = np.concatenate((np.zeros(1000), np.full(2000, 2.5)))
    assert [round(h, 1) for h in floor_heights(z, np.full(3000, 1.3), np.array([1.3]))] == [0.0]


def test_each_storey_has_the_map_of_its_height():
    grids = [OccupancyGrid(np.full((4, 4), value, np.int8), 0.05, (0.0, 0.0)) for value in (0, 100)]
    maps = [StoreyMap("walk", grids[0], 0.0), StoreyMap("walk", grids[1], 3.0)]
    floors = floors_of(site([(0, 0, 1.2, 0.0), (0, 0, 1.2, 3.0)], maps), [])
    assert [floor.grid for floor in floors] == grids


def test_a_storey_without_a_map_gets_a_grid_from_what_was_seen_there():
    grid = OccupancyGrid(np.full((4, 4), 100, np.int8), 0.05, (0.0, 0.0))
    floors = floors_of(site([(0, 0, 1.2, 0.0), (5, 5, 1.2, 3.0)], [StoreyMap("walk", grid, 0.0)]), [])
    assert floors[0].grid is grid
    assert floors[1].grid.at(np.array([5.0, 5.0])) == 0 and floors[1].grid.at(np.array([0.0, 0.0])) == -1


def test_without_keyframes_the_objects_stand_on_one_floor():
    x = np.linspace(0, 1, 50)
    (floor,) = floors_of(Surroundings(), [np.column_stack((x, x, np.full(50, 0.4))), np.column_stack((x, x, x))])
    assert floor.grid is None and floor.height_m == pytest.approx(0.4, abs=0.05) and floor.holds(99.0)
    assert [f.height_m for f in floors_of(Surroundings(), [])] == [0.0]


@pytest.mark.parametrize("z", [1600.0, -1200.0])
def test_whatever_the_maps_zero_is_everything_stands_on_a_floor(z):
    (floor,) = floors_of(site([(0, 0, 1.2, z), (1, 0, 1.2, z)]), [])
    low, high = floor.room_heights_m()
    assert low < z - 100 and z + 100 < high and np.isfinite([low, high]).all()
    assert all(floor.holds(height) for height in (z, -3e9, 3e9))


def test_an_empty_given_room_is_on_the_floor_of_its_heights(tiny_encoder):
    around = site([(0, 0, 1.2, z) for z in (0.0, 3.0, 6.0)])
    for number, heights_m in enumerate([(0.0, 2.5), (3.0, 5.5), (6.0, 9.0)]):
        room = Room("store", [[0, 0], [1, 0], [1, 1]], heights_m=heights_m)
        graph = scene_graph(ObjectMemory.build([], tiny_encoder, rooms=[room], surroundings=around))
        assert [floor.floor.id for floor in graph.floors if floor.rooms] == [number] and len(graph.floors) == 3


def test_a_walk_too_wide_for_a_grid_has_its_floor_and_says_why_it_has_no_rooms(observe, tiny_encoder):
    around = site([(0, 0, 1.2, 0.0), (900, 0, 1.2, 0.0)])
    memory = with_derived_rooms(ObjectMemory.build([observe("chair")], tiny_encoder, surroundings=around))
    graph = scene_graph(memory)
    assert [floor.floor.grid for floor in graph.floors] == [None] and memory.rooms == ()
    assert "spans more than 500 m" in graph.lacks and "\n" not in graph.lacks


def test_the_stairs_that_were_walked_between_two_storeys_are_no_floor():
    rooms = [(0.6 * x, 0.6 * y, 1.2, z) for z in (0.0, 3.0) for x in range(5) for y in range(5)]
    stairs = [(0.3 * k, -2.0, 1.2, 0.25 * k) for k in range(1, 12)]
    floors = floors_of(site([*rooms[:25], *stairs, *rooms[25:]]), [])
    assert [round(floor.height_m, 1) for floor in floors] == [0.0, 3.0]
