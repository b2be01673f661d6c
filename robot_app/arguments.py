"""What argparse asks of a word on the command line: what is wrong here is wrong usage, exit status 2."""

from __future__ import annotations

import argparse


def from_one(text: str) -> int:
    """A whole number from 1."""
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"a whole number from 1, not {text!r}")
    return int(text)


def perception(text: str) -> str:
    """KIND:ARGUMENT of a kind that there is."""
    from robot_app.cli import Failure
    from robot_app.perceptions import FORMS, kind_of

    try:
        kind_of(text)
    except Failure as failure:
        raise argparse.ArgumentTypeError(f"should be {FORMS}, not {text!r}") from failure
    return text
