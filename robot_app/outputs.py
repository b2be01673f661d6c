"""Files that a verb is asked to write: what is wrong with their names is said before any work."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from robot_app.cli import Failure


def require_writable(path: Path) -> None:
    """Raises Failure where it is a folder, or its folder is not there."""
    if path.is_dir():
        raise Failure(f"{path} is a folder: name the file to write in it.")
    if not path.parent.is_dir():
        raise Failure(f"The folder {path.parent} does not exist: create it, or write to another.")


def require_kind(path: Path, option: str, kinds: Sequence[str]) -> None:
    """Raises Failure where the name does not end in a kind that can be drawn."""
    if path.suffix not in kinds:
        raise Failure(f"{option} {path}: the name should end in {' or '.join(kinds)}.")
