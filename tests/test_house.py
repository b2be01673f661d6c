"""What no linter says of the house: a name stands for one thing, no import is hidden to break a circle, and what is
written can be held in the head.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("openbelief", "drivers", "logs", "behaviors", "sim_fakes", "robot_app")
FILE_MAX, FUNCTION_MAX = 400, 45  # lines; most have a quarter of that
TABLES = {"openbelief.grounded.lexicon"}  # rows, and no logic among them


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


def test_no_file_holds_so_much_that_it_must_hold_a_second_noun(house):
    lines = {module: max((node.end_lineno or 0 for node in tree.body), default=0) for module, tree in house.items()}
    assert {module: n for module, n in lines.items() if n > FILE_MAX and module not in TABLES} == {}


def test_no_function_is_so_long_that_it_must_mix_levels(house):
    functions = (
        (f"{module}.{node.name}", (node.end_lineno or 0) - node.lineno + 1)
        for module, tree in house.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    )
    assert {name: n for name, n in functions if n > FUNCTION_MAX} == {}
