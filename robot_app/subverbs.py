"""Verbs of a verb: a module of a package for each row of a table, as `openbelief bench` and `openbelief eval` have."""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Mapping


def add_subverbs(parser: argparse.ArgumentParser, package: str, summaries: Mapping[str, str], *, metavar: str) -> None:
    """A sub-parser for each name of the table; its module has `add_arguments`, `run` and a docstring, its help."""
    parsers = parser.add_subparsers(dest="subverb", metavar=metavar, required=True)
    for name, summary in summaries.items():
        module = importlib.import_module(f"{package}.{name}")
        one = parsers.add_parser(name, help=summary, description=(module.__doc__ or summary).strip())
        one.add_argument("--json", action="store_true", default=argparse.SUPPRESS, help="machine-readable result")
        module.add_arguments(one)
        one.set_defaults(run_subverb=module.run)


def run_subverb(options: argparse.Namespace) -> int | None:
    """The exit status of the one that was named, None for 0."""
    status: int | None = options.run_subverb(options)
    return status
