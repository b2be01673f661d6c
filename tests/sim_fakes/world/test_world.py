from __future__ import annotations

import json

import numpy as np
import pytest

from drivers.clock import SimClock
from openbelief.traversability import FREE, OCCUPIED, UNKNOWN
from sim_fakes.world.robot import SimRobot
from sim_fakes.world.scene import SceneError
from sim_fakes.world.walk import keyframes
from sim_fakes.world.world import World


def changed(scene, tmp_path, path, value):
    """The scene with one value set (or, for ..., removed), written to a file."""
    node = scene
    for key in path[:-1]:
        node = node[key]
    if value is ...:
        del node[path[-1]]
    else:
        node[path[-1]] = value
    file = tmp_path / "changed.json"
    file.write_text(json.dumps(scene))
    return file


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        (("objects", 1, "shape"), "teapot", r"object 101 \(box\).*'shape'.*teapot"),
        (("objects", 1, "colour"), "mauve", r"object 101 \(box\).*'colour'.*mauve"),
        (("objects", 1, "size"), [0.4, 0, 0.3], r"object 101 \(box\).*'size\.1'"),
        (("objects", 1, "size"), ..., r"object 101 \(box\).*'size'"),
        (("objects", 0, "weight"), 3, r"object 100 \(vase\).*'weight'.*unknown key"),
        (("objects", 0, "confusion", "rate"), 1.5, r"object 100 \(vase\).*'confusion\.rate'"),
        (("objects", 0, "names_far"), {"vase": 0}, r"object 100 \(vase\).*'names_far"),
        (("objects", 0, "id"), 101, r"object 101.*'id'.*used by 2"),
        (("objects", 0, "id"), 7, r"'id'"),
        (("objects", 2, "mesh"), "x.obj", r"object 102 \(cabinet\).*'shape'"),
        (("rooms", 0, "floor"), "lava", r"'rooms\.0\.floor'"),
        (("doors", 0, "at"), [2, 1.5], r"door at \[2\.0, 1\.5\].*no wall"),
        (("queries", 0, "accept"), [999], r"query 'vase'.*999"),
        (("format",), "openbelief.scene/9", r"'format'"),
        (("surprise",), 1, r"'surprise'.*unknown key"),
        (("start",), ..., r"'start'"),
    ],
)
def test_a_wrong_scene_is_refused_with_the_object_and_the_field_named(small_scene, tmp_path, path, value, named):
    file = changed(small_scene, tmp_path, path, value)
    with pytest.raises(SceneError, match=named) as refused:
        World.load(file)
    assert "\n" not in str(refused.value)


def test_what_is_no_json_and_what_is_not_there_are_refused(tmp_path):
    (tmp_path / "broken.json").write_text('{"format": ')
    with pytest.raises(SceneError, match=r"broken\.json is not a JSON scene"):
        World.load(tmp_path / "broken.json")
    with pytest.raises(SceneError, match="No such file"):
        World.load(tmp_path / "absent.json")


def test_a_mesh_beside_the_scene_stands_where_it_is_put(small_scene, tmp_path):
    (tmp_path / "wedge.obj").write_text(
        "v 0 0 0\nv 0.4 0 0\nv 0 0.4 0\nv 0 0 0.6\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    )
    small_scene["objects"][1] = {"id": 101, "label": "wedge", "mesh": "wedge.obj", "position": [2, 2], "colour": "blue"}
    world = World.load(changed(small_scene, tmp_path, ("name",), "meshes"))
    assert world.object(101).aabb == pytest.approx(np.array([[2, 2, 0], [2.4, 2.4, 0.6]]))


@pytest.mark.parametrize("text", ["", "v 0 0 0\nf 1 2 3\n", "v 0 zero 0\n", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"])
def test_a_mesh_that_is_none_is_refused_by_its_object(small_scene, tmp_path, text):
    (tmp_path / "bad.obj").write_text(text)
    small_scene["objects"][1] = {"id": 101, "label": "wedge", "mesh": "bad.obj", "position": [2, 2], "colour": "blue"}
    with pytest.raises(SceneError, match=r"object 101 \(wedge\).*'mesh'.*bad\.obj"):
        World.load(changed(small_scene, tmp_path, ("name",), "meshes"))


def test_the_grid_shows_walls_doors_things_and_the_outside(small_world):
    grid = small_world.occupancy_grid()

    def cell(x: float, y: float) -> int:
        return int(grid.cells[int((y - grid.origin_xy[1]) / 0.05), int((x - grid.origin_xy[0]) / 0.05)])

    assert cell(1.0, 1.5) == FREE
    assert cell(4.02, 1.5) == FREE  # the doorway, under its lintel
    assert cell(4.02, 0.5) == OCCUPIED
    assert cell(0.02, 1.0) == OCCUPIED
    assert cell(2.4, 1.2) == OCCUPIED  # inside the vase
    assert cell(3.6, 0.3) == OCCUPIED  # inside the cabinet, taller than the band
    assert cell(-0.2, 1.0) == UNKNOWN


def test_the_truth_lists_every_object_with_its_box_and_room(small_world):
    truth = small_world.truth()
    assert truth["format"] == "openbelief.truth/1"
    assert [o["id"] for o in truth["objects"]] == [100, 101, 102]
    assert truth["objects"][0]["room"] == "lab"
    assert np.array(truth["objects"][0]["aabb"]) == pytest.approx(
        np.array([[2.25, 1.05, 0], [2.55, 1.35, 0.5]]), abs=0.01
    )
    assert json.loads(json.dumps(truth)) == truth


def test_the_built_in_flat_is_as_rich_as_promised():
    world = World.load("flat")
    labels = [o.label for o in world.objects]
    assert len(world.rooms) >= 4
    assert len(world.objects) >= 30
    assert {"chair", "plant", "bin"} <= {label for label in labels if labels.count(label) >= 3}
    names = {o.spec.confusion.phrase for o in world.objects if o.spec.confusion}
    assert len(names & set(labels)) >= 3  # things that are called what another thing is
    assert {o.room for o in world.objects} == {room.name for room in world.rooms}


def test_the_robot_can_walk_the_built_in_walk_and_visits_every_room():
    world, clock = World.load("flat"), SimClock(0)
    robot = SimRobot(world, clock, world.start_pose)
    poses = list(keyframes(robot, clock, world.walk))
    assert {world.room_at(p.xy) for p in poses} == {room.name for room in world.rooms}
    assert len(poses) <= 150  # a demo has to render them all
