"""`openbelief eval missions`: whole simulated missions with known truth, by either check, in a folder that goes on."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from openbelief.evaluation.statistics import wilson
from robot_app.cli import main
from robot_app.evals.mission_runs import MissionRun
from robot_app.evals.missions import summary

SMALL = Path(__file__).parents[1] / "small_scene.json"


def made(**more) -> MissionRun:
    values = {"seed": 1, "query": "bucket", "kind": "direct", "check": "relative", "end": "CONFIRMED", "reason": "r"}
    values |= {"visits": 1, "right": True, "far": False, "rejected_right": 0, "mapped": True, "content_hash": "h"}
    return MissionRun(**values | more)


def test_missions_run_by_both_checks_and_a_second_call_goes_on_from_the_first(tmp_path, capsys):
    arguments = ["eval", "missions", "--scene", str(SMALL), "--out", str(tmp_path / "runs"), "--json"]
    assert main([*arguments, "--seeds", "1"]) == 0
    first = json.loads(capsys.readouterr().out)
    assert [(m["seed"], m["check"]) for m in first["missions"]] == [(1, "paper"), (1, "relative")]
    assert first["checks"]["relative"]["confirmed_right"]["missions"] == 1
    before = (tmp_path / "runs" / "runs.jsonl").read_text()
    (tmp_path / "runs" / "seed-002-relative.mcap.partial").write_bytes(b"of an interrupted run")
    assert main([*arguments, "--seeds", "2", "--arrival-check", "relative"]) == 0
    said = capsys.readouterr()
    again = json.loads(said.out)
    assert [(m["seed"], m["query"]) for m in again["missions"]] == [(1, "find the bucket"), (2, "go to the armchair")]
    assert again["missions"][0] == first["missions"][1] and "seed 2, relative" in said.err
    assert (tmp_path / "runs" / "runs.jsonl").read_text().startswith(before)
    assert main([*arguments[:-1], "--seeds", "2", "--arrival-check", "relative"]) == 0
    assert "simulated, 2 seeds" in capsys.readouterr().out


def test_what_is_counted():
    runs = [
        made(),
        made(right=False, far=True, rejected_right=1, visits=2),
        made(right=False, far=False),
        made(right=None, far=None, rejected_right=2, visits=2, end="FAILED", mapped=False),
    ]
    found = summary(runs)
    counts = {name: row["missions"] for name, row in found.items() if isinstance(row, dict)}
    assert counts == {
        "confirmed_right": 1,
        "confirmed_false": 2,
        "confirmed_over_1_m_away": 1,
        "rejected_right": 2,
        "nothing_confirmed": 1,
    }
    assert found["confirmed_false"]["interval"] == pytest.approx(list(wilson(2, 4)))
    assert (found["missions"], found["visits"], found["not_mapped"]) == (4, 1.5, 1)


def test_a_scene_that_is_none_is_refused_in_one_line(tmp_path, capsys):
    assert main(["eval", "missions", "--scene", "no-such.json", "--out", str(tmp_path / "runs")]) == 1
    assert "no-such.json" in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()
