"""docs/nav2.md promises a test for every failure mode: the tests exist, and none of Nav2's is left out."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
MODES = range(1, 15)


def rows() -> list[list[str]]:
    table = (ROOT / "docs" / "nav2.md").read_text().split("## Failure modes")[1].split("\n## ")[0]
    cells = [line.strip("|").split("|") for line in table.splitlines() if "`test_" in line and line.startswith("|")]
    return [[cell.strip() for cell in row] for row in cells]


def names_of_tests() -> set[str]:
    files = (ROOT / "tests" / "drivers").rglob("*.py")
    return {name for file in files for name in re.findall(r"^def (test_\w+)", file.read_text(), re.MULTILINE)}


def test_every_test_named_on_the_page_exists():
    named = {row[3].strip("`") for row in rows()}
    assert named and named <= names_of_tests(), named - names_of_tests()


def test_every_failure_mode_has_a_row():
    assert {row[0] for row in rows()} >= {str(mode) for mode in MODES}


def test_every_row_names_its_end():
    assert all(row[2] for row in rows())
