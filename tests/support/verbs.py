"""What a verb answers, as a program asks it."""

from __future__ import annotations

import json
from typing import Any

import pytest

from robot_app.cli import main


def answer(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    """The verb's JSON, of a call that succeeds."""
    assert main([*map(str, arguments), "--json"]) == 0
    return dict(json.loads(capsys.readouterr().out))
