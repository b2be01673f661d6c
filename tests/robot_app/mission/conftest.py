"""What the tests of missions share."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def config(small_site: Path) -> Path:
    """The demo's robot.toml, with a person's yes before motion."""
    path = small_site / "asking.toml"
    text = (small_site / "robot.toml").read_text()
    path.write_text(text.replace('motion = "allow"', 'motion = "ask"').replace("confirm_timeout_s = 10.0", ""))
    return path
