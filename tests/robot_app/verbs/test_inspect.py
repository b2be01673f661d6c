from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from openbelief import ObjectMemory, Observation
from openbelief.derived_rooms import with_derived_rooms
from openbelief.perception.sentence import SentenceEncoder
from openbelief.surroundings import Surroundings
from robot_app.cli import main
from support.verbs import answer


@pytest.fixture(scope="module")
def memory(demo_folder):
    """The demo's small room, mapped: its rooms were given, its keyframes and its map lie in the file."""
    return demo_folder / "site.belief"


def test_floors_hold_rooms_hold_objects_and_views_show_them(memory, capsys):
    site = answer(capsys, "inspect", memory)
    assert [floor["id"] for floor in site["floors"]] == [0] and abs(site["floors"][0]["height_m"]) < 0.1
    rooms = [room for floor in site["floors"] for room in floor["rooms"]]
    assert rooms and all(set(room) == {"id", "name", "given", "polygon", "because", "objects"} for room in rooms)
    assert all(room["given"] for room in rooms)
    placed = {i: room["name"] for room in rooms for i in room["objects"]}
    assert {o["id"]: o["room"] for o in site["objects"] if o["room"]} == placed
    assert site["views"] and np.shape(site["views"][0]["pose"]) == (4, 4) and site["lacks"] is None


def test_an_objects_best_view_is_one_that_shows_it(memory, capsys):
    site = answer(capsys, "inspect", memory)
    best = [(o["id"], o["best_view"]) for o in site["objects"] if o["best_view"]]
    assert len(best) == len(site["objects"])
    for object_id, view in best:
        shown = site["views"][view["view"]]
        assert object_id in shown["objects"]
        assert (shown["recording"], shown["stamp_ns"]) == (view["recording"], view["stamp_ns"])


def test_the_tree_names_floors_rooms_and_objects(memory, capsys):
    assert main(["inspect", str(memory)]) == 0
    said = capsys.readouterr().out
    assert "floor 0 at" in said and "(given)" in said and "keyframes" in said


@pytest.mark.parametrize("kind", ["png", "svg"])
def test_the_plan_is_drawn_and_the_same_memory_gives_the_same_bytes(memory, tmp_path, capsys, kind):
    plans = [tmp_path / f"{k}.{kind}" for k in (1, 2)]
    for plan in plans:
        assert answer(capsys, "inspect", memory, "--plan", plan)["plan"] == str(plan)
    assert plans[0].read_bytes() == plans[1].read_bytes()
    if kind == "png":
        assert min(cv2.imread(str(plans[0])).shape[:2]) > 500


def test_a_view_is_told_of_and_its_picture_written(memory, tmp_path, capsys):
    view = answer(capsys, "inspect", memory, "--view", 0, "--out", tmp_path / "view.jpg")
    assert view["view"] == 0 and view["stamp_ns"] > 0
    assert cv2.imread(str(tmp_path / "view.jpg")).shape == (480, 640, 3)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--plan", "plan.pdf"], "should end in .png or .svg"),
        (["--plan", "nowhere/plan.png"], "The folder nowhere does not exist"),
        (["--plan", "."], "is a folder"),
        (["--view", "99999"], "has no view 99999: it holds 0 to"),
        (["--view", "-1"], "has no view -1"),
        (["--out", "view.jpg"], "name one with --view"),
    ],
)
def test_what_cannot_be_written_or_is_not_there_is_one_line(memory, tmp_path, monkeypatch, capsys, arguments, said):
    monkeypatch.chdir(tmp_path)
    assert main(["inspect", str(memory), *arguments]) == 1
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1 and not list(tmp_path.iterdir())


UP_M = 3.0


def upstairs(memory):
    """The same site again, one storey higher, as the second recording."""
    observations = []
    for o in memory.observations:
        source = replace(o.provenance, recording="upstairs")
        points = o.points + np.float32([0, 0, UP_M])
        observations.append(Observation(o.frame, o.mask, o.phrase, o.confidence, points, o.feature, source))
    views = []
    for view in memory.surroundings.views:
        pose = view.T_map_camera.copy()
        pose[2, 3] += UP_M
        views.append(replace(view, recording="upstairs", T_map_camera=pose))
    return observations, views


def test_a_site_of_two_storeys_has_its_rooms_and_objects_on_both(memory, tmp_path, capsys):
    below = ObjectMemory.open(memory)
    observations, views = upstairs(below)
    first = below.surroundings.views[0].recording

    def images(key):
        return below.surroundings.images((first, key[1]))

    around = Surroundings((*below.surroundings.views, *views), below.surroundings.maps, images)  # the map is of below
    both = ObjectMemory.build([*below.observations, *observations], SentenceEncoder(), surroundings=around)
    with_derived_rooms(both).save(tmp_path / "two.belief")
    site = answer(capsys, "inspect", tmp_path / "two.belief", "--plan", tmp_path / "two.png")
    assert [round(floor["height_m"], 1) for floor in site["floors"]] == [0.0, UP_M]
    low, high = site["floors"]
    assert len(low["rooms"]) == len(high["rooms"]) > 0
    assert not {room["name"] for room in low["rooms"]} & {room["name"] for room in high["rooms"]}
    count = [sum(len(room["objects"]) for room in floor["rooms"]) + len(floor["in_no_room"]) for floor in (low, high)]
    assert count[0] == count[1] == len(below.objects)
    stairs = {view["recording"] for view in site["views"] if set(view["objects"]) & set(high["rooms"][0]["objects"])}
    assert stairs == {"upstairs"}  # no look from below goes through the ceiling
