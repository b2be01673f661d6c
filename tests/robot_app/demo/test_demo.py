"""The loop as a stranger sees it. The outcome follows from the checks: other noise, other question, other story."""

import json
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from openbelief.memory import ObjectMemory
from robot_app.cli import Failure, build_parser, main
from robot_app.demo.folder import Files
from sim_fakes.world.world import World

SMALL = Path(__file__).parents[1] / "small_scene.json"
README = Path(__file__).resolve().parents[3] / "README.md"
EXTINGUISHER = "take me to the fire extinguisher"
STORIES = [
    *((1, EXTINGUISHER), (2, EXTINGUISHER), (4, EXTINGUISHER)),
    *((1, "find the green bucket"), (1, "find the saxophone")),  # the last is nowhere: nobody drives
]


def demo(capsys, folder: Path, *arguments: str) -> dict:
    """The demo's exit status is part of its promise: 0 whenever the trial replays identically."""
    assert main(["demo", "--json", "--out", str(folder), *arguments]) == 0
    return json.loads(capsys.readouterr().out)


def stands_in(memory_path: str, object_id: int, label: str, world: World) -> bool:
    """Whether a mapped object's centroid lies in the box of a true object of that label (0.25 m of slack)."""
    centroid = np.asarray(ObjectMemory.open(Path(memory_path)).objects[object_id].centroid)
    boxes = [thing.aabb for thing in world.objects if thing.label == label]
    return any(((centroid >= low - 0.25) & (centroid <= high + 0.25)).all() for low, high in boxes)


def test_other_noise_and_other_questions_give_other_stories_and_every_one_replays(capsys, tmp_path):
    world, endings = World.load(SMALL), set()
    for number, (seed, query) in enumerate(STORIES):
        told = demo(capsys, tmp_path / str(number), "--scene", str(SMALL), "--seed", str(seed), "--query", query)
        assert told["replay"] == "identical"
        endings.add((told["outcome"], told["visits"]))
        if told["outcome"] == "CONFIRMED":
            label = "bucket" if "bucket" in query else "fire extinguisher"
            assert stands_in(told["paths"]["memory"], told["object_id"], label, world)
    assert len(endings) >= 3


@pytest.fixture(scope="module")
def flat_demo(tmp_path_factory) -> subprocess.CompletedProcess[str]:
    """`make demo`, once: in a process of its own, in demo-out."""
    command = [sys.executable, "-m", "robot_app.cli", "demo", "--json", "--out", "demo-out"]
    folder = tmp_path_factory.mktemp("flat")
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False, cwd=folder)
    done.folder = folder
    return done


def test_the_flats_best_candidate_is_rejected_at_arrival_and_the_true_extinguisher_confirmed(flat_demo, monkeypatch):
    assert flat_demo.returncode == 0, flat_demo.stderr[-2000:]
    monkeypatch.chdir(flat_demo.folder)
    told = json.loads(flat_demo.stdout)
    assert (told["outcome"], told["visits"], told["replay"]) == ("CONFIRMED", 2, "identical")
    assert stands_in(told["paths"]["memory"], told["object_id"], "fire extinguisher", World.load("flat"))
    pictures = {path.name for path in Path(told["paths"]["pictures"]).iterdir()}
    assert pictures == {"top_view.png", *(f"arrival_{look}.png" for look in (1, 2, 3))}  # the first one twice
    questions = [line for line in flat_demo.stderr.splitlines() if "May I walk to the" in line]
    assert ["fire extinguisher in the hall" in questions[0], "in the kitchen" in questions[1]] == [True, True]


def test_a_simulated_trial_is_told_apart_from_a_robots(flat_demo, capsys):
    folder = str(flat_demo.folder / "demo-out")
    assert main(["trials", folder, "--json"]) == 0
    assert [trial["simulated"] for trial in json.loads(capsys.readouterr().out)["trials"]] == [True]
    assert main(["trials", folder]) == 0
    assert capsys.readouterr().out.splitlines()[0].endswith("simulated")


def test_what_the_readme_says_to_try_then_works_as_pasted(flat_demo, monkeypatch, capsys):
    """Over the folder that `make demo` leaves. The other demo among the lines is only parsed: it takes a minute."""
    monkeypatch.chdir(flat_demo.folder)
    tried = README.read_text().split("Then try:")[1].split("Every verb")[0]
    lines = [shlex.split(line, comments=True) for line in tried.splitlines() if line.strip()]
    assert {verb for _, verb, *_ in lines} >= {"query", "why", "ask", "replay", "demo"}
    for command, verb, *arguments in lines:
        assert command == ".venv/bin/openbelief"
        if verb == "demo":
            build_parser("demo").parse_args(arguments)
            continue
        assert main([verb, *arguments]) == 0, (verb, capsys.readouterr().err)
        shown = capsys.readouterr().out
        assert "CONFIRMED" in shown or verb != "ask"
        assert "identical" in shown or verb != "replay"


def test_a_demo_over_an_earlier_one_leaves_nothing_of_it_and_everything_else(capsys, small_site):
    """The earlier one was cut off on the way; the trials and the walk beside it are somebody's."""
    stale = ("site.belief.walk-0a1b2c3d.perception.jsonl", "site.belief.partial", "trial.mcap.partial")
    mine = ("walk-monday.mcap", "site.belief.bak", "trial_17.mcap", "pictures/holiday.png", "my.toml")
    for name in (*stale, *mine):
        (small_site / name).write_text("left here")
    told = demo(capsys, small_site, "--scene", str(SMALL), "--query", "go to the armchair")
    assert told["replay"] == "identical"
    assert [name for name in stale if (small_site / name).exists()] == []
    assert [(small_site / name).read_text() for name in mine] == ["left here"] * len(mine)
    rooms = {node.room for node in ObjectMemory.open(small_site / "site.belief").objects}
    assert {room.name for room in World.load(SMALL).rooms} & rooms


def claim(folder: Path) -> str | None:
    """Why the folder is not a demo's to use, None where it is and was made ready."""
    try:
        Files(folder).claim()
    except Failure as failure:
        return str(failure)
    return None


def test_a_folder_of_an_unmarked_demo_of_before_is_recognised(small_site):
    (small_site / ".openbelief-demo").unlink()
    config = small_site / "robot.toml"
    config.write_text("".join(line for line in config.read_text().splitlines(keepends=True) if line[0] != "#"))
    assert claim(small_site) is None
    assert [path.name for path in small_site.rglob("*") if path.is_file()] == [".openbelief-demo"]


@pytest.mark.parametrize("name", ["robot.toml", "walk.mcap", "site.belief", "log.jsonl", "pictures/arrival_2.png"])
def test_a_file_that_no_demo_wrote_is_never_touched(tmp_path, name):
    theirs = tmp_path / name
    theirs.parent.mkdir(exist_ok=True)
    theirs.write_text("precious")
    because = claim(tmp_path)
    assert because and str(theirs) in because and "--out" in because and "\n" not in because
    assert theirs.read_text() == "precious" and not (tmp_path / ".openbelief-demo").exists()


def test_a_real_robot_s_folder_is_none_of_a_demo_s(small_site):
    (small_site / ".openbelief-demo").unlink()
    config = small_site / "robot.toml"
    config.write_text(config.read_text().replace('navigator = "sim"', 'navigator = "ros"'))
    before = {path: path.read_bytes() for path in small_site.rglob("*") if path.is_file()}
    assert claim(small_site) is not None
    assert {path: path.read_bytes() for path in small_site.rglob("*") if path.is_file()} == before


def test_a_folder_with_other_files_is_used_and_they_stay(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    assert claim(tmp_path) is None and (tmp_path / "notes.txt").read_text() == "mine"
    assert claim(tmp_path / "a" / "b") is None
    assert "notes.txt is a file" in str(claim(tmp_path / "notes.txt"))


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [(["--scene", "no-such-scene.json"], "no-such-scene.json"), (["--query", "  "], "names nothing")],
)
def test_what_cannot_be_asked_or_shown_is_refused_before_anything_is_removed(capsys, small_site, arguments, complaint):
    before = {path: path.stat().st_mtime_ns for path in small_site.rglob("*")}
    assert main(["demo", "--out", str(small_site), "--scene", str(SMALL), *arguments]) == 1
    printed = capsys.readouterr()
    [line] = printed.err.strip().splitlines()
    assert complaint in line and printed.out == ""
    assert {path: path.stat().st_mtime_ns for path in small_site.rglob("*")} == before
