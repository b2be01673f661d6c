"""`openbelief eval verification`: on a small simulated walk, and on the shared apartment."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from robot_app.cli import main

RECORDINGS = Path(__file__).resolve().parents[3].parent / "shared" / "recordings"


def test_a_demos_walk_scores_both_checks_and_draws_their_curves(demo_folder, tmp_path, capsys):
    files = [str(demo_folder / name) for name in ("site.belief", "walk.mcap", "walk.truth.json")]
    plot = tmp_path / "curves.png"
    assert main(["eval", "verification", *files, "--plot", str(plot), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["text_encoder"].startswith("fast-universal") and result["plot"] == str(plot)
    assert set(result["checks"]) == {"paper", "relative"} and result["cases"]["wrong"] > 0
    assert result["checks"]["relative"]["wrong"]["confirmed"] <= result["checks"]["paper"]["wrong"]["confirmed"]
    assert plot.read_bytes()[1:4] == b"PNG"
    assert main(["eval", "verification", *files]) == 0
    shown = capsys.readouterr().out
    assert (
        "relative" in shown and "confirmed, 95 % interval: walk.truth.json" in shown and "at other thresholds" in shown
    )


def test_a_recording_of_another_walk_is_refused_in_one_line(demo_folder, small_site, capsys):
    files = [str(demo_folder / "site.belief"), str(small_site / "trial.mcap"), str(demo_folder / "walk.truth.json")]
    assert main(["eval", "verification", *files, "--json"]) == 1
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


@pytest.mark.recordings
def test_the_apartments_wrong_candidates_are_not_confirmed_and_its_true_ones_are(tmp_path, capsys):
    recording = RECORDINGS / "apartment.mcap"
    if not recording.exists():
        pytest.skip("apartment.mcap is not in ../shared/recordings")
    memory = str(tmp_path / "apartment.belief")
    assert main(["map", str(recording), "-o", memory, "--json"]) == 0
    capsys.readouterr()
    truth = str(RECORDINGS / "apartment.truth.json")
    assert main(["eval", "verification", memory, str(recording), truth, "--json"]) == 0
    checks = json.loads(capsys.readouterr().out)["checks"]
    assert checks["relative"]["true"]["confirmed"] >= 0.85 and checks["relative"]["wrong"]["confirmed"] <= 0.05
    assert checks["paper"]["true"]["confirmed"] < checks["relative"]["true"]["confirmed"]
