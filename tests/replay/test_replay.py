"""Trials of long ago still decide the same: a replay test is a row of data (tests/replay/README.md)."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from logs.trial.compare import compare_decisions
from logs.trial.records import RECORDS, Record
from openbelief.perception.ports import PerceptionFailed
from robot_app.cli import main
from robot_app.mission.replay import replay_trial
from robot_app.perceptions import KINDS, PerceptionKind

HERE = Path(__file__).parent
SCENE = HERE.parent / "robot_app" / "small_scene.json"
MAX_BYTES = 2_500_000
SMALL_ROOM = HERE / "small_room.mcap"
TRIALS = sorted(HERE.glob("*.mcap"))


def expected(path: Path) -> list[Record]:
    rows = json.loads(path.with_suffix(".json").read_text())["decisions"]
    return [
        RECORDS[row["topic"]].model_validate_json(json.dumps({k: v for k, v in row.items() if k != "topic"}))
        for row in rows
    ]


@pytest.mark.parametrize("path", TRIALS, ids=lambda path: path.stem)
def test_a_trial_of_long_ago_replays_to_the_expected_decisions(path):
    replayed = replay_trial(path)
    assert replayed.difference is None, str(replayed.difference)
    difference = compare_decisions(expected(path), replayed.decisions)
    assert difference is None, str(difference)


def test_every_trial_is_small_expected_and_named_on_the_page():
    page = (HERE / "README.md").read_text()
    assert SMALL_ROOM in TRIALS
    for path in TRIALS:
        assert path.stat().st_size < MAX_BYTES and f"| `{path.stem}` |" in page
    assert {path.stem for path in TRIALS} == {path.stem for path in HERE.glob("*.json")}


def look_again(capsys, *arguments: str) -> tuple[int, dict]:
    status = main(["replay", str(SMALL_ROOM), "--perception", f"scripted:{SCENE}", *arguments, "--json"])
    return status, json.loads(capsys.readouterr().out)


def test_the_same_perception_looking_again_decides_the_same(capsys):
    status, report = look_again(capsys)
    assert (status, report["replay"], report["verdicts_same"]) == (0, "identical", True)
    assert [look["recorded"]["verdict"] for look in report["looks"]] == ["no matching mask", "confirmed"]
    for look in report["looks"]:
        assert look["recorded"]["semantic"] == pytest.approx(look["replayed"]["semantic"], abs=0.05)


def test_another_perception_is_compared_look_by_look_and_the_first_difference_named(capsys):
    """Other noise calls the extinguisher a red bottle: what was confirmed is not, and the mission goes another way."""
    status, report = look_again(capsys, "--seed", "4")
    assert (status, report["replay"], report["verdicts_same"]) == (1, "different", False)
    assert report["perception"]["recorded"] != report["perception"]["replayed"]
    difference = report["difference"]
    assert (difference["record"], difference["field"]) == ("/trial/checks", "semantic.value")
    assert difference["by"] > 0.05
    last = report["looks"][-1]
    assert (last["recorded"]["verdict"], last["replayed"]["verdict"]) == ("confirmed", "no matching mask")


def test_other_masks_that_decide_the_same_are_identical_and_shown(capsys):
    """Seed 2 sees fewer masks, of other words; every verdict is the same."""
    assert main(["replay", str(SMALL_ROOM), "--perception", f"scripted:{SCENE}", "--seed", "2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("perception then scripted:") and "seed=1" in lines[0] and "seed=2" in lines[0]
    assert lines[1].startswith("look 1: 2 masks, now 1;") and lines[1].endswith(
        "no matching mask, now no matching mask"
    )
    assert lines[-1].startswith("identical: ")


class Blind:
    """Cannot look at anything."""

    id = "blind"
    feature_text_aligned = True

    def perceive(self, frame):
        raise PerceptionFailed("The model server does not answer.")


def test_a_perception_that_fails_is_named_and_no_verdict_is_blamed(monkeypatch, capsys):
    monkeypatch.setitem(KINDS, "blind", PerceptionKind(lambda *_: Blind(), "NOTHING", expensive=False))
    assert main(["replay", str(SMALL_ROOM), "--perception", "blind:x"]) == 1
    printed = capsys.readouterr()
    assert "blind could not look" in printed.err and "does not answer" in printed.err and printed.out == ""


def test_a_perception_that_cannot_look_is_refused_in_one_line(capsys):
    assert main(["replay", str(SMALL_ROOM), "--perception", "scripted:no-scene.json"]) == 1
    [line] = capsys.readouterr().err.strip().splitlines()
    assert "no-scene.json" in line


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--perception", "telepathy:yes"], "argument --perception: should be recorded:FILE.jsonl"),
        (["--seed", "3"], "--seed is for --perception"),
    ],
)
def test_a_command_line_that_cannot_be_meant_is_wrong_usage(arguments, complaint, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["replay", str(SMALL_ROOM), *arguments])
    assert ended.value.code == 2 and complaint in capsys.readouterr().err
