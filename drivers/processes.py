"""How a program that we started ends: it was told to, is waited for, and killed where it does not."""

from __future__ import annotations

import subprocess
from typing import Any


def end_or_kill(process: subprocess.Popen[Any], patience_s: float) -> int:
    """The exit status of a process that was told to end (a signal, the end of its input); negative where killed."""
    try:
        return process.wait(patience_s)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()
