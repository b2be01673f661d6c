"""Tables for people, on stdout: what came from a model or a file is shown as plain text, never as markup."""

from __future__ import annotations

from typing import TYPE_CHECKING

from openbelief.phrase import printable

if TYPE_CHECKING:
    from rich.table import Table
    from rich.text import Text


def cell(words: str) -> Text:
    """Words of unknown origin as a table cell."""
    from rich.text import Text

    return Text(printable(words))


def number(value: float | None, digits: int = 3) -> str:
    """A dash where there is no value."""
    return "-" if value is None else f"{value:.{digits}f}"


def show(table: Table) -> None:
    """Print it; into a file or a pipe without cutting it to a screen's width."""
    import sys

    from rich.console import Console

    Console(width=None if sys.stdout.isatty() else 200).print(table)
