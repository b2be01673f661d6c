"""The shared recordings, from MCAP to scores: what a plain reading of the paper reaches is the least we reach."""

from __future__ import annotations

import json
import runpy
from pathlib import Path

import pytest

from openbelief.perception.sentence import SentenceEncoder
from openbelief.verification import TAU_Q
from robot_app.cli import main

RECORDINGS = Path(__file__).resolve().parents[2].parent / "shared" / "recordings"
SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "calibrate_tau_q.py"
pytestmark = pytest.mark.recordings

# queries, and R@1, R@3, SR@1m of shared/reference/evaluation.md
REACHED = {
    "apartment": (50, {"consensus": (0.90, 0.92, 0.90), "early": (0.66, 0.88, 0.68), "belief": (0.84, 0.94, 0.84)}),
    "kitchen": (14, {"consensus": (0.86, 0.86, 0.93), "early": (0.71, 0.86, 0.79), "belief": (0.71, 0.86, 0.93)}),
}


@pytest.mark.parametrize("name", REACHED)
def test_a_plain_reading_of_the_paper_is_reached(name, tmp_path, capsys):
    if not (RECORDINGS / f"{name}.mcap").exists():
        pytest.skip(f"{name}.mcap is not in ../shared/recordings")
    memory = str(tmp_path / f"{name}.belief")
    assert main(["map", str(RECORDINGS / f"{name}.mcap"), "-o", memory, "--json"]) == 0
    capsys.readouterr()
    queries, table = REACHED[name]
    for readout, expected in table.items():
        truth = str(RECORDINGS / f"{name}.truth.json")
        assert main(["eval", "retrieval", memory, truth, "--readout", readout, "--json"]) == 0
        result = json.loads(capsys.readouterr().out)
        assert result["queries"] == queries and result["readout"] == readout
        slack = 1 / queries + 0.005  # one query, and the table's rounding
        got = (result["r_at_1"], result["r_at_3"], result["sr_at_1m"])
        assert all(g >= e - slack for g, e in zip(got, expected, strict=True)), (readout, got, expected)
        assert result["nodes"]["purity"] is None or result["nodes"]["purity"] > 0.99
    if name == "apartment":
        assert_calibrated(memory, truth, capsys)
        assert_rooms_found(memory, truth, capsys)


def assert_rooms_found(memory: str, truth: str, capsys) -> None:
    """Mapped without rooms: the map shows them, and what stands in them."""
    assert main(["eval", "rooms", memory, truth, "--json"]) == 0
    scores = json.loads(capsys.readouterr().out)
    assert scores["given"] == 0 and scores["right"] >= 0.9, scores["wrong"]


def assert_calibrated(memory: str, truth: str, capsys) -> None:
    """tau_q is the threshold with the least error that the script finds."""
    runpy.run_path(str(SCRIPT))["main"]([memory, truth])
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    assert len(rows) > 3 and float(min(rows, key=lambda row: float(row[-1]))[0]) == TAU_Q[SentenceEncoder().id]
