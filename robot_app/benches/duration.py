"""How long a bench runs, as its command line says it."""

from __future__ import annotations

import argparse


def seconds(text: str) -> float:
    """1 to 3600; raises ArgumentTypeError."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 1.0 <= value <= 3600.0:
        raise argparse.ArgumentTypeError(f"seconds must be a number from 1 to 3600, got '{text}'")
    return value
