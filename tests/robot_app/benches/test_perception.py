"""`openbelief bench perception` on the tiny exported networks."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from robot_app.cli import main

FIXTURES = Path(__file__).resolve().parents[2] / "openbelief" / "perception" / "fixtures"


@pytest.mark.parametrize("clip", ["clip", "clip-fp16"])
def test_every_stage_is_timed_for_every_image_size(clip, capsys):
    folders = ["--sam3", str(FIXTURES / "sam3"), "--clip", str(FIXTURES / clip)]
    sizes = ["--sizes", "64x48", "96x72"]
    assert main(["bench", "perception", *folders, *sizes, "--device", "cpu", "--repeat", "1", "--json"]) in (None, 0)
    stages = json.loads(capsys.readouterr().out)["stages"]
    names = ["SAM 3 image", "SAM 3 8 prompts", "SAM 3 whole", "CLIP frame, 24 crops"]
    assert [(row["size"], row["stage"]) for row in stages] == [(s, name) for s in sizes[1:] for name in names]
    assert all(row["ms"] > 0 and row["per_s"] > 0 and row["host_mib"] > 0 for row in stages)


def test_a_device_that_is_not_there_is_one_clear_line(capsys):
    assert main(["bench", "perception", "--clip", str(FIXTURES / "clip"), "--device", "tensorrt"]) == 1
    assert "device tensorrt: this onnxruntime has" in capsys.readouterr().err.splitlines()[-1]
