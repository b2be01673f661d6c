"""Generated documentation is what the code says now."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import re
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any

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


def symbols() -> list[str]:
    """What the code column of docs/conventions.md names; `.field` and a bare name go with the class before them."""
    table = (ROOT / "docs" / "conventions.md").read_text().split("## Symbols")[1].split("\n\n")[0]
    names: list[str] = []
    for row in table.splitlines()[3:]:
        for said in re.findall(r"`([^`]+)`", row.rsplit("|", 2)[1]):
            first, *rest = said.split(", ") if "(" not in said else [said]
            owner = (names[-1] if first.startswith(".") else first).split("(")[0].split(".")[0]
            names += [owner + first if first.startswith(".") else first, *(f"{owner}.{name}" for name in rest)]
    return names


HOMES = ("memory", "observation", "parameters", "association", "belief", "retrieval")


def resolved(name: str) -> Any:
    """The class, function, field or method of the core that a name of the table means."""
    modules = [importlib.import_module(f"openbelief.{home}") for home in HOMES]
    head, *tail = name.split("(")[0].split(".")
    if head in HOMES:
        return getattr(importlib.import_module(f"openbelief.{head}"), tail[0])
    owner = next(getattr(module, head) for module in modules if hasattr(module, head))
    if tail and tail[0] in getattr(owner, "__dataclass_fields__", {}):
        return owner.__dataclass_fields__[tail[0]]
    return getattr(owner, tail[0]) if tail else owner


def test_every_symbol_of_the_paper_is_in_the_code_under_the_name_that_conventions_give_it():
    names = symbols()
    assert {"Observation.n", "belief.weight", "Concept.belief", "ObjectNode.trust", "Parameters.k_max"} <= set(names)
    for name in names:
        if name in ("exclude", "rank", "retrieve"):
            continue
        made = resolved(name)
        if "(" in name:
            arguments = name.split("(")[1].rstrip(")").split(", ")
            assert set(arguments) <= set(inspect.signature(made).parameters), name
    for method in ("rank", "retrieve"):
        assert "exclude" in inspect.signature(getattr(resolved("ObjectMemory"), method)).parameters


def test_a_page_without_its_markers_is_refused(write_docs):
    with pytest.raises(ValueError, match="one pair of markers"):
        write_docs.rewritten("docs/mission.md", "# The mission\n")
