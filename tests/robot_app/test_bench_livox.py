"""`openbelief bench livox` runs the emulated lidar in another process and reports what the receiver took and lost."""

from __future__ import annotations

import json

import pytest

from robot_app.cli import main


def test_the_bench_reports_loss_and_the_receivers_share(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "livox", "--seconds", "1", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["lost"] == 0
    assert result["refused"] == 0
    assert result["points_per_s"] == pytest.approx(200_000, rel=0.01)
    assert result["imu_samples"] == pytest.approx(200, abs=6)
    assert 0 < result["cpu_share"] < 1
    assert result["clouds"] >= 8


@pytest.mark.parametrize("words", [["bench"], ["bench", "nothing"], ["bench", "livox", "--seconds", "0"]])
def test_wrong_usage_is_status_two(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    assert capsys.readouterr().err
