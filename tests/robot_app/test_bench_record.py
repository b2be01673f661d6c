"""The recording's bench measures a real run: everything that its sources sent lies on the disk, whole."""

from __future__ import annotations

import json

import pytest

from robot_app.cli import main


def test_a_second_at_full_rate_is_recorded_without_loss(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "record", "--seconds", "1", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["lost"] == result["dropped"] == 0
    assert result["sent"]["/livox/imu"] == 200 and result["sent"]["/camera/color/image_raw"] == 30
    assert result["file_mb"] > 1 and result["cpu_cores"] > 0
