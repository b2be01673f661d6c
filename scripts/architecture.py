"""The house for docs/architecture.md: rooms and arrows from the import contracts and the imports, walks from a table.

A walk is a list of (file, name, what happens there). `check_walks` raises where a file or a name is gone, so a walk
cannot rot; `scripts/write_docs.py` draws all of it.
"""

from __future__ import annotations

import ast
import tomllib
from functools import cache
from itertools import groupby
from pathlib import Path

from walks import RETURNS, WALKS, Stop

ROOT = Path(__file__).resolve().parents[1]


def layers() -> list[list[str]]:
    """The packages from the top of the house to its ground, as the first import contract says."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    return [[name.strip() for name in layer.split("|")] for layer in contracts[0]["layers"]]


def contracts() -> list[str]:
    """The names of the contracts, in their order."""
    return [
        each["name"]
        for each in tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    ]


def rooms(package: str) -> list[str]:
    """The packages inside a package."""
    return sorted(path.parent.name for path in (ROOT / package).glob("*/__init__.py"))


@cache
def imports() -> frozenset[tuple[str, str]]:
    """(from package, to package) where a module of the first imports something of the second."""
    names = [name for layer in layers() for name in layer]
    imported = {name: set().union(*(_imported(path) for path in (ROOT / name).rglob("*.py"))) for name in names}
    return frozenset((name, other) for name in names for other in imported[name] & set(names) if other != name)


def _imported(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    said = [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    said += [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    return {name.split(".")[0] for name in said}


def diagram() -> str:
    """Mermaid: every package with its rooms, and who imports whom."""
    lines = ["flowchart TD"]
    for layer in layers():
        for package in layer:
            inside = ", ".join(rooms(package))
            lines.append(f'    {package}["<b>{package}</b><br/>{inside or "one room"}"]')
    lines += [f"    {source} --> {target}" for source, target in sorted(imports())]
    return "\n".join(["```mermaid", *lines, "```"])


def walks() -> str:
    """The walks as numbered lists, each with its length in files and rooms."""
    check_walks()
    return "\n\n".join(_walk(name, stops) for name, stops in WALKS.items())


def _walk(name: str, stops: list[Stop]) -> str:
    visited = rooms_visited(stops)
    back = f", entered {len(visited)} times: {RETURNS[name]}" if name in RETURNS else ""
    head = f"### {name}\n\n{len({file for file, *_ in stops})} files, {len(set(visited))} rooms{back}.\n"
    return "\n".join([head, *(f"{k}. `{file}` `{symbol}`: {said}" for k, (file, symbol, said) in enumerate(stops, 1))])


def rooms_visited(stops: list[Stop]) -> list[str]:
    """The rooms of a walk in order, a stay counted once."""
    return [room for room, _ in groupby(str(Path(file).parent) for file, *_ in stops)]


def check_walks() -> None:
    """Raises ValueError where a walk names a file or a definition that is not there, or returns without a reason."""
    for walk, stops in WALKS.items():
        visited = rooms_visited(stops)
        if (len(visited) > len(set(visited))) != (walk in RETURNS):
            raise ValueError(f"{walk}: RETURNS gives a reason exactly where a room is entered twice")
        for file, symbol, _ in stops:
            if not (ROOT / file).is_file():
                raise ValueError(f"{walk}: there is no {file}")
            if symbol not in _definitions(ROOT / file):
                raise ValueError(f"{walk}: {file} defines no {symbol}")


@cache
def _definitions(path: Path) -> frozenset[str]:
    """Functions, classes and `Class.method`s of a file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    top = [node for node in tree.body if isinstance(node, kinds)]
    inner = [
        f"{c.name}.{m.name}" for c in top if isinstance(c, ast.ClassDef) for m in c.body if isinstance(m, kinds[:2])
    ]
    return frozenset([*(node.name for node in top), *inner])


def contract_list() -> str:
    return "\n".join(f"- {name}" for name in contracts())
