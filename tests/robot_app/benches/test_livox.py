"""`openbelief bench livox` runs the emulated lidar in another process and reports what the receiver took and lost."""

from __future__ import annotations

import json

import pytest

from robot_app.cli import main


def test_every_packet_of_a_second_is_received_or_counted_as_lost(capsys: pytest.CaptureFixture[str]) -> None:
    """That none is lost is the bench's own claim: a machine with other work may not empty its sockets in time."""
    status = main(["bench", "livox", "--seconds", "1", "--json"])
    result = json.loads(capsys.readouterr().out)
    sent = result["sent"]
    assert 96 * sent["points"] == pytest.approx(200_000, rel=0.01)
    assert sent["imu"] == pytest.approx(200, abs=6)
    assert result["packets"] + result["imu_samples"] + result["lost"] == sent["points"] + sent["imu"]
    assert 0 <= result["lost_by_counter"] <= result["lost"]  # a gap is seen once something comes behind it
    assert result["refused"] == 0
    assert status == (1 if result["lost"] else 0)
    assert result["cpu_share"] > 0 and result["clouds"] > 0


@pytest.mark.parametrize("words", [["bench"], ["bench", "nothing"], ["bench", "livox", "--seconds", "0"]])
def test_wrong_usage_is_status_two(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    assert capsys.readouterr().err
