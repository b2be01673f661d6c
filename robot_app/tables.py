"""Tables for people, on stdout: what came from a model or a file is shown as plain text, never as markup."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from openbelief.phrase import printable

if TYPE_CHECKING:
    import argparse

    from rich.table import Table
    from rich.text import Text

NARROW, WIDE = 80, 240


def cell(words: str) -> Text:
    """Words of unknown origin as a table cell."""
    from rich.text import Text

    return Text(printable(words))


def number(value: float | None, digits: int = 3) -> str:
    """A dash where there is no value."""
    return "-" if value is None else f"{value:.{digits}f}"


def add_wide(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--wide", action="store_true", help="all columns, however wide (default: what fits 80)")


def show(table: Table, *, wide: bool = False) -> None:
    """Print it as wide as the terminal, 80 columns into a file or a pipe; long cells take more lines, none is cut."""
    import sys

    from rich.console import Console

    for column in table.columns:
        column.overflow = "fold"
    Console(width=WIDE if wide else None if sys.stdout.isatty() else NARROW).print(table)


def chosen(table: Table, names: Collection[str], *, wide: bool) -> Table:
    """The columns that fit 80 characters, or all of them."""
    if not wide:
        table.columns = [column for column in table.columns if column.header in names]
    return table
