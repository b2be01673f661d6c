"""Tables fit a terminal of 80 columns and lose no word; --wide shows every column."""

from __future__ import annotations

import pytest

from robot_app.cli import main


def test_the_list_of_models_fits_80_columns_and_wide_shows_all(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models", "list"]) == 0
    narrow = capsys.readouterr().out
    assert max(map(len, narrow.splitlines())) <= 80 and "repository" not in narrow
    assert main(["models", "list", "--wide"]) == 0
    wide = capsys.readouterr().out
    assert "repository" in wide and "facebook/sam3" in wide
