"""The recording's bench keeps its books: what its sources sent lies on the disk, whole, or is counted as missing."""

from __future__ import annotations

import json

import pytest

from robot_app.cli import main


def test_every_message_of_a_second_at_full_rate_is_on_the_disk_or_counted(capsys: pytest.CaptureFixture[str]) -> None:
    """That none is missing is the bench's own claim, of a machine that has nothing else to do."""
    status = main(["bench", "record", "--seconds", "1", "--json"])
    result = json.loads(capsys.readouterr().out)
    sent, taken, written = (sum(result[part].values()) for part in ("sent", "taken", "written"))
    assert result["sent"]["/livox/imu"] == 200 and result["sent"]["/camera/color/image_raw"] == 30
    assert sent == taken + result["lost_on_the_way"] and taken == written + result["dropped"]
    assert result["lost"] == result["lost_on_the_way"] + result["dropped"]
    assert status == (1 if result["lost"] else 0)
    assert written > 0 and result["file_mb"] > 0 and result["cpu_cores"] > 0
