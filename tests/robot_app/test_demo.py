"""The loop as a stranger sees it. The outcome follows from the checks: other noise, other question, other story."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from openbelief.memory import ObjectMemory
from robot_app.cli import main
from sim_fakes.world import World

SMALL = Path(__file__).parent / "small_scene.json"
EXTINGUISHER = "take me to the fire extinguisher"
STORIES = [(1, EXTINGUISHER), (2, EXTINGUISHER), (4, EXTINGUISHER), (1, "find the green bucket")]


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


def test_the_flats_best_candidate_is_rejected_at_arrival_and_the_true_extinguisher_confirmed(tmp_path):
    command = [sys.executable, "-m", "robot_app.cli", "demo", "--json", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    told = json.loads(done.stdout)
    assert (told["outcome"], told["visits"], told["replay"]) == ("CONFIRMED", 2, "identical")
    assert stands_in(told["paths"]["memory"], told["object_id"], "fire extinguisher", World.load("flat"))
    pictures = {path.name for path in Path(told["paths"]["pictures"]).iterdir()}
    assert pictures == {"top_view.png", "arrival_1.png", "arrival_2.png"}


def test_a_demo_over_an_old_one_leaves_nothing_of_it(capsys, tmp_path):
    for stale in ("site.belief.walk-0.perception.jsonl", "site.belief.partial", "trial.mcap.partial"):
        (tmp_path / stale).write_text("left by a run that was interrupted")
    told = demo(capsys, tmp_path, "--scene", str(SMALL), "--query", "go to the armchair")
    assert told["replay"] == "identical"
    assert not list(tmp_path.glob("*.partial"))


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [(["--scene", "no-such-scene.json"], "no-such-scene.json"), (["--query", "  "], "names nothing")],
)
def test_a_demo_that_cannot_be_says_why_in_one_line(capsys, tmp_path, arguments, complaint):
    assert main(["demo", "--out", str(tmp_path), "--scene", str(SMALL), *arguments]) == 1
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert complaint in error
