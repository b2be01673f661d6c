"""Generated documentation is what the code says now."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def write_docs() -> ModuleType:
    spec = importlib.util.spec_from_file_location("write_docs", ROOT / "scripts" / "write_docs.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_no_page_is_stale(write_docs):
    assert write_docs.stale_pages() == [], "run python scripts/write_docs.py"


def test_a_changed_page_is_found_stale_and_mended(write_docs, tmp_path):
    for page in {page for page, _ in write_docs.GENERATED}:
        (tmp_path / page).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / page, tmp_path / page)
    page = tmp_path / "docs/mission.md"
    page.write_text(page.read_text().replace("verify --> confirmed", "verify --> failed"))
    assert write_docs.stale_pages(tmp_path) == ["docs/mission.md"]
    assert write_docs.rewritten("docs/mission.md", page.read_text()) == (ROOT / "docs/mission.md").read_text()


def test_a_page_without_its_markers_is_refused(write_docs):
    with pytest.raises(ValueError, match="one pair of markers"):
        write_docs.rewritten("docs/mission.md", "# The mission\n")
