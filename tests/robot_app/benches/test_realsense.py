"""`openbelief bench realsense` runs the camera process on librealsense's software device and says what it costs."""

from __future__ import annotations

import json

import pytest

from drivers.realsense.messages import COLOR_SIZES
from robot_app.cli import main


def test_each_colour_size_gives_images_and_its_losses_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    """That none is lost is the bench's own claim: a machine with other work may not keep up."""
    status = main(["bench", "realsense", "--seconds", "1", "--json"])
    rows = json.loads(capsys.readouterr().out)["sizes"]
    assert [tuple(row["color_size"]) for row in rows] == list(COLOR_SIZES)
    assert all(row["images_per_s"] >= 0 and row["camera_cpu_share"] > 0 for row in rows)
    assert status == (1 if any(row["lost"] or row["no_slot"] for row in rows) else 0)
