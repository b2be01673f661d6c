"""Whatever comes over a wire ends in a message or in a wire's error: no crash, no other exception, no gigabytes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

FUZZ = Path(__file__).with_name("fuzz.py")
ROUNDS = 300


def test_spoiled_bytes_of_every_kind_end_in_an_error_of_the_wire():
    ended = subprocess.run(
        [sys.executable, str(FUZZ), "all", str(ROUNDS)], capture_output=True, text=True, cwd=FUZZ.parents[3]
    )
    said = ended.stdout.splitlines()
    assert (ended.returncode, said[-1]) == (0, "done"), f"{said[-2:]}\n{ended.stderr[-3000:]}"
