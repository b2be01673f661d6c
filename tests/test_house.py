"""What no linter says of the house: a name stands for one thing, and no import is hidden to break a circle."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("openbelief", "drivers", "logs", "behaviors", "sim_fakes", "robot_app")


@pytest.fixture(scope="module")
def house() -> dict[str, ast.Module]:
    """Every module of the product by its dotted name."""
    files = (file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py")))
    return {
        ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): ast.parse(file.read_text())
        for file in files
    }


def imported(node: ast.AST, house: dict[str, ast.Module]) -> Iterator[str]:
    """The modules of the house that an import statement loads."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if alias.name in house)
    elif isinstance(node, ast.ImportFrom) and node.module:
        for alias in node.names:
            within = f"{node.module}.{alias.name}"
            yield from (name for name in (within if within in house else node.module,) if name in house)


def reached(module: str, loads: dict[str, set[str]]) -> set[str]:
    found: set[str] = set()
    ahead = [module]
    while ahead:
        new = loads[ahead.pop()] - found
        found |= new
        ahead += new
    return found


def test_a_public_class_name_stands_for_one_thing(house):
    places: dict[str, list[str]] = defaultdict(list)
    for module, tree in house.items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(module)
    assert {name: modules for name, modules in places.items() if len(modules) > 1} == {}


def test_no_import_inside_a_function_breaks_a_circle(house):
    """It may spare a start the time of a library; with it at the module's top there must be no circle either."""
    top: dict[str, set[str]] = {}
    inside: list[tuple[str, str]] = []
    for module, tree in house.items():
        nested = {
            node
            for function in ast.walk(tree)
            if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef)
            for node in ast.walk(function)
        }
        inside += [(module, name) for node in nested for name in imported(node, house)]
        top[module] = {n for node in ast.walk(tree) if node not in nested for n in imported(node, house)} - {module}
    assert [module for module in house if module in reached(module, top)] == []
    assert [(module, name) for module, name in inside if module in reached(name, top)] == []
